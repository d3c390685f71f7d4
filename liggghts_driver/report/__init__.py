"""The report: one page that opens anywhere, with its figures beside it."""
