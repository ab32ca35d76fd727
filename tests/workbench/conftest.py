"""The browser is a fixture of every module that asks for it."""

from tests.workbench.browser import browser, page_of

__all__ = ["browser", "page_of"]
