"""Estimates compared: of one robot then and now, and of robots of one kind.

In: estimates with their covariances. Out: what differs beyond their joint uncertainty.
"""
