"""Where the ablations look for what is in the harness now."""

from benchmarks.harness.timing import Cost as Cost
from benchmarks.harness.timing import in_turns as in_turns
from benchmarks.harness.timing import median_ratio as median_ratio
