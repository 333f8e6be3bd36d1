"""Formats of robot descriptions: one file or folder each, and what they share.

A format is a `Format` (`format`): how to read a description, its shapes and its joints' dynamics,
and how to write an inertia. To add one, write such a record in a file of its own and name it in
`reading.FORMATS`. `xmltree` and `elements` hold what readers of XML need; `tree_assembly` lets
Drake's parser make the tree of joints and links out of a sanitised copy of the description.

Why not a library: Drake, Pinocchio and MuJoCo each read these formats, and each of them repairs or
refuses a broken inertia, which here is to be seen as it is written, named, and replaced in place.
"""
