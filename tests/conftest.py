"""Hypothesis profiles: HYPOTHESIS_PROFILE=slow draws many more examples than the default, fast."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

for name, examples in (("fast", 60), ("slow", 2000)):
    settings.register_profile(
        name,
        max_examples=examples,
        deadline=None,
        # in CI a run must not depend on luck; at the desk every run looks at new examples
        derandomize=bool(os.environ.get("CI")),
        # drawing a model and a history is most of the work, and a busy machine is no bug
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fast"))
