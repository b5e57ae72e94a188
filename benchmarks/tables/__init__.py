"""Tables like the paper's, one command each: python -m benchmarks.tables.NAME writes docs/tables/NAME.md."""
