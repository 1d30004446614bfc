"""Exports of the boom to other tools."""
