"""From a case to the text that the engine reads."""
