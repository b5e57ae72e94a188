"""How good and how fast: judged against light fields and stereo scenes whose views are known."""
