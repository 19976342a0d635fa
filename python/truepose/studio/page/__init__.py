"""The page of a studio: the live page with the machine file behind it, and the scripts of that."""

from truepose.studio.page.served import Page, studio_page

__all__ = ["Page", "studio_page"]
