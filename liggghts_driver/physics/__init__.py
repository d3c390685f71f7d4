"""Closed-form physics that decks are written from and results are held to."""
