"""The interactive page: a frozen state, views as pure functions of it, and a local server.

The page knows no physics: every number is taken from `boom_model` and the rooms below.
"""
