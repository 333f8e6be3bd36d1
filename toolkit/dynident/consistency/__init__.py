"""Can this robot exist? The margin of every rule of physical consistency, link by link."""

from dynident.consistency.checking import check
from dynident.consistency.findings import Check
from dynident.consistency.joint_parameters import JointCheck
from dynident.consistency.link import LinkCheck
from dynident.consistency.remedy import Change
from dynident.consistency.rules import RuleMargin

__all__ = ["Change", "Check", "JointCheck", "LinkCheck", "RuleMargin", "check"]
