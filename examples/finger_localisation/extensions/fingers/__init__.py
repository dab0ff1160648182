"""Localise a touched finger: the task `fingers.localise`, its test `fingers.transmitted`, its figure."""

from .confusions import CONFUSIONS
from .localise import LOCALISE, QUESTIONS
from .transmitted import TRANSMITTED

VERSION = "1.0"
TASKS = {"localise": LOCALISE}
FORMS = {"localise": QUESTIONS}
TESTS = {"transmitted": TRANSMITTED}
FIGURES = {"confusions": CONFUSIONS}
