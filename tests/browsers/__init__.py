"""Browsers for tests and benchmarks of pages, all with the interface of `page.Page`."""
