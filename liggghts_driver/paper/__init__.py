"""The paper's example, run, and held against what the paper prints."""
