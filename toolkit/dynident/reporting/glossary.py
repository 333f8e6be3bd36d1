"""What each effect is, for a reader who has never heard its name."""

from __future__ import annotations

from dynident.effects import Effect

_MEANINGS: dict[str, str] = {
    "asymmetric_friction": "the joint resists differently in its two directions of motion",
    "backlash": "there is play in the transmission: when the load changes sides, the motor turns a "
    "little before the link follows",
    "base_tilt": "the robot does not stand upright, so gravity pulls in another direction than the "
    "model says",
    "contact": "something pushed the robot for a moment in one recording: it touched an obstacle, "
    "or someone touched it",
    "coulomb_friction": "dry friction, the same at any speed, that changes sign with the direction "
    "of motion",
    "drive_gain": "the drive gives more or less torque than it reports, in a fixed proportion",
    "joint_coupling": "moving one joint loads the drive of another, as belts, cables and "
    "differential gears do",
    "joint_elasticity": "the transmission gives like a spring between motor and link, so that the "
    "link swings after the motor",
    "joint_spring": "something pulls the joint towards one position like a spring: a balancer, a "
    "hose, a bundle of cables",
    "joint_zero": "the encoder's zero is not where the robot description has it, so that the joint "
    "stands at another angle than it reports",
    "load_friction": "the joint's friction grows with the load that its gears and bearings carry",
    "payload": "the robot carries something that the model does not know of",
    "presliding": "before it slips the joint gives a little, so that friction builds up over a "
    "small distance after each reversal",
    "quadratic_drag": "the resistance grows with the square of the speed, as in oil or air",
    "rotor_inertia": "the motor's spinning rotor must be accelerated too; seen from the link it is "
    "an inertia of its own",
    "stribeck_friction": "the joint resists more when it creeps than when it glides: friction "
    "falls as motion starts",
    "thermal_friction": "friction changes as the joint warms up",
    "torque_delay": "the torque is recorded a moment later than the motion",
    "torque_drift": "the reading of the torque creeps away from zero as time goes by",
    "torque_offset": "the torque reads a constant too much or too little",
    "torque_ripple": "the torque swells and fades with the position, as the teeth of a gear and "
    "the magnets of a motor make it",
    "viscous_friction": "a resistance in proportion to the speed, as from grease",
}

_SHOWS: dict[str, str] = {
    "velocity": "Friction shows here.",
    "position": "Gravity, springs and whatever depends on the position show here.",
    "acceleration": "Inertia shows here.",
    "load": "Load is the torque predicted: a wrong gain of the drive shows here.",
    "time": "Warming up, drifting and single disturbance pulses show here.",
    "cycles per revolution": "What comes back several times in each turn, as teeth and magnets do, "
    "shows here as a narrow peak.",
}


def meaning(effect: Effect) -> str:
    """What an effect is, as a clause in plain words."""
    return _MEANINGS.get(effect.name, f"it shows as {effect.sign_of}")


def use_of(against: str) -> str:
    """What a residual map against this quantity is looked at for; empty where that is not known."""
    return _SHOWS.get(against, "")
