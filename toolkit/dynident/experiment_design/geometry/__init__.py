"""Where the bodies of a robot are: its shapes as its description states them, and what they touch.

`robot_shapes` has Drake read them, `clearance` says how far they stay from each other,
`surroundings` are boxes to stay in and obstacles, and `workspace` all of that together.
"""
