"""What benchmarks share: scenes, timing, reports and how they are called, plots; each once."""
