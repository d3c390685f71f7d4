"""The accuracy that a scene asks for: from a study of its problem to numerical settings."""

from liggghts_driver.accuracy.choice import Choice, choose
from liggghts_driver.accuracy.problem import (
    is_of_another_problem,
    makes_a_problem,
    problem_sha256,
)
from liggghts_driver.accuracy.settings import FINEST
from liggghts_driver.accuracy.settle import settle
from liggghts_driver.accuracy.study import Study
from liggghts_driver.accuracy.words import accuracy_facts

__all__ = [
    "FINEST",
    "Choice",
    "Study",
    "accuracy_facts",
    "choose",
    "is_of_another_problem",
    "makes_a_problem",
    "problem_sha256",
    "settle",
]
