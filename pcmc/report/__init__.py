"""Reports: a roof on A4 pages for those who decide about it, with pictures, plan, verdict and tables.

Gives ``roof_report`` and its value to projects and the command. May import ``plot`` and the rooms below it.
"""

from .document import RoofReport, roof_report

__all__ = ["RoofReport", "roof_report"]
