"""Tests against a real Slurm, started on this machine."""
