"""Receiver-autonomous integrity monitoring on a known track (Lacresse, Grall & Nikiforov 2005)."""

from surefix.raim.affine import AffineModel, affine_bound
from surefix.raim.availability import AvailabilityMap, availability
from surefix.raim.chi_squared import missed, noncentrality, power, threshold
from surefix.raim.geodesy import ecef_to_geodetic, geodetic_to_ecef, local_axes, sky
from surefix.raim.linear_test import LinearTest, LinearTestResult, parity_test, ubcp_test
from surefix.raim.masks import Cutting, Tunnel
from surefix.raim.monitor import TrackRaim
from surefix.raim.pseudorange_files import read_pseudoranges
from surefix.raim.pseudoranges import Pseudoranges, elevation_sigma
from surefix.raim.result import RaimResult
from surefix.raim.split import SplitModel, split
from surefix.raim.track import Projection, Track
from surefix.raim.track_files import read_track

__all__ = [
    "AffineModel",
    "AvailabilityMap",
    "Cutting",
    "LinearTest",
    "LinearTestResult",
    "Projection",
    "Pseudoranges",
    "RaimResult",
    "SplitModel",
    "Track",
    "TrackRaim",
    "Tunnel",
    "affine_bound",
    "availability",
    "ecef_to_geodetic",
    "elevation_sigma",
    "geodetic_to_ecef",
    "local_axes",
    "missed",
    "noncentrality",
    "parity_test",
    "power",
    "read_pseudoranges",
    "read_track",
    "sky",
    "split",
    "threshold",
    "ubcp_test",
]
