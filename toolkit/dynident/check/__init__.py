"""Can this robot exist? The margin of every rule of physical consistency, link by link."""

from dynident.check.joints import JointCheck
from dynident.check.link import LinkCheck
from dynident.check.mend import Change
from dynident.check.report import Check
from dynident.check.rules import RuleMargin
from dynident.check.verb import check

__all__ = ["Change", "Check", "JointCheck", "LinkCheck", "RuleMargin", "check"]
