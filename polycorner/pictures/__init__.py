"""Figures of regions, clusters, disks and studies; never imported by the core."""
