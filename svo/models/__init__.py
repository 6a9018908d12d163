"""Uncertain linear parameter-varying models: construction, discretisation, normal form, simulation."""
