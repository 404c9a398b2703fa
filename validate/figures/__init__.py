"""Figures of one trial, one function each."""
