"""The interactive page: one frozen state, views as pure functions of it, and a server on the loopback address.

The page knows no physics: every number is taken from `boom_model` and the rooms below.
"""
