"""The engine: found, launched, followed, and believed only with proof."""
