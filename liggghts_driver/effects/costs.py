"""What each effect adds to the time of a step, over that of the contacts alone.

Measured side by side with ``make bench`` on the full case, the dilute start and the dense state
averaged (docs/benchmarks.md). They divide a step among the effects; they are not a stopwatch.
"""

FRICTION = 0.5
ROLLING = 0.1
COHESION = 0.1
WALL = 0.01
PISTON = 0.1
UNIFORM_FORCE = 0.1
FORMULA_FORCE = 0.5
#: One step of each drag scheme; a kept force added by ``fix addforce``; one refresh.
DRAG = {"exact": 30.0, "held": 0.15, "implicit": 0.35}
HELD_BY_ADDFORCE = 0.5
REFRESH = 5.0

#: The contacts alone, nanoseconds per particle and step on one core of the benchmark's machine.
CONTACTS_NS = {"dilute": 36.0, "packed": 190.0}
