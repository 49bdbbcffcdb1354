"""Figures and tables of results; knows results, not where they are stored."""
