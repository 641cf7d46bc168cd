"""The report of a study: one page, figures for print, tables and numbers."""

from ikns.view.study_report.page import Part, study_html
from ikns.view.study_report.write import report_files, write_study_report

__all__ = ["Part", "report_files", "study_html", "write_study_report"]
