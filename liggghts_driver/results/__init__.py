"""What the engine wrote, read back."""
