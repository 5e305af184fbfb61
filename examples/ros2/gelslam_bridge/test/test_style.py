from pathlib import Path

from ament_flake8.main import main as flake8
from ament_pep257.main import main as pep257

PACKAGE = str(Path(__file__).resolve().parents[1])


def test_flake8():
    assert flake8([PACKAGE]) == 0


def test_pep257():
    assert pep257([PACKAGE]) == 0
