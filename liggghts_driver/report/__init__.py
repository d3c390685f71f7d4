"""The report: one page that opens anywhere, with its figures beside it."""

from liggghts_driver.report.write import write_report

__all__ = ["write_report"]
