"""``python -m liggghts_driver``."""

from liggghts_driver.cli import main

main()
