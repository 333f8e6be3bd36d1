"""Columns of a model along a motion, the torque that they predict, and how fast they are evaluated.

`column_function` writes them out as CasADi functions of an instant, `mapped` evaluates such a
function at all instants of a motion, and `predicted_torque` says how far the torque may be from
what the columns predict.
"""
