"""Columns of effects and links along recordings, kept by all that they depend on.

Those that follow from a motion alone (`motion_columns`), those that depend on a fitted model as
well (`fitted_columns`), and how both are put together joint by joint (`joint_columns`).
"""
