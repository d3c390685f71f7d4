"""Physics of the real engine against exact solutions."""
