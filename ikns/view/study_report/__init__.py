"""The report of a study: one page, figures for print, tables and numbers."""

from ikns.view.study_report.write import (
    report_files,
    study_page,
    write_study_report,
)

__all__ = ["report_files", "study_page", "write_study_report"]
