"""Browsers for tests of pages, all with the interface of `page.Page`."""
