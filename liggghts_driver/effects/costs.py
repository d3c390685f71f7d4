"""What each effect adds to the time of a step, over that of the contacts alone.

Measured side by side with ``make bench`` on the full case (docs/benchmarks.md); each figure is the
mean of the dilute start and the dense state. They divide a step among the effects; they are not a
stopwatch.
"""

FRICTION = 0.24
ROLLING = 0.23
COHESION = 0.02
#: Longer neighbour lists, walked twice.
NEAR_FIELD = 1.3
UNIFORM_FORCE = 0.10
#: One step of each drag scheme; a kept force added by ``fix addforce``; one refresh.
DRAG = {"exact": 36.0, "held": 0.14, "implicit": 0.35}
HELD_BY_ADDFORCE = 0.50
REFRESH = 3.0
#: From a profile of the dilute start: one plane wall, and the bookkeeping of a mesh's contacts.
WALL = 0.002
PISTON = 0.14
#: A force by a formula at every step: taken to be as a kept force, which is read in the same way.
FORMULA_FORCE = HELD_BY_ADDFORCE

#: The contacts alone, nanoseconds per particle and step on one core of the benchmark's machine.
CONTACTS_NS = {"dilute": 35.0, "packed": 216.0}
