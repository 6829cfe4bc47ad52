"""Where the sun stands, from time and place: the low-precision formulas of the Astronomical Almanac [Michalsky88], good to 0.01°
from 1950 to 2050; refraction, half a degree at the horizon, is left out.
"""

from __future__ import annotations

import datetime
import math

from app.scene.sky import Sun

J2000 = datetime.datetime(2000, 1, 1, 12, tzinfo=datetime.UTC)


def sun_at(time: datetime.datetime, latitude: float, longitude: float) -> Sun:
    """time: with a zone. latitude, longitude: in degrees, north and east. The height is below zero at night."""
    days = (time - J2000).total_seconds() / 86400
    mean_longitude = 280.460 + 0.9856474 * days
    anomaly = math.radians(357.528 + 0.9856003 * days)
    ecliptic = math.radians(mean_longitude + 1.915 * math.sin(anomaly) + 0.020 * math.sin(2 * anomaly))
    obliquity = math.radians(23.439 - 4e-7 * days)
    ascension = math.atan2(math.cos(obliquity) * math.sin(ecliptic), math.cos(ecliptic))
    declination = math.asin(math.sin(obliquity) * math.sin(ecliptic))
    sidereal = math.radians(280.46062 + 360.98564737 * days + longitude)  # angle of Greenwich, and of the place
    hour, north = sidereal - ascension, math.radians(latitude)
    sine = math.sin(north) * math.sin(declination) + math.cos(north) * math.cos(declination) * math.cos(hour)
    east = -math.cos(declination) * math.sin(hour)
    northward = math.sin(declination) * math.cos(north) - math.cos(declination) * math.sin(north) * math.cos(hour)
    return Sun(math.degrees(math.atan2(east, northward)) % 360, math.degrees(math.asin(max(-1.0, min(sine, 1.0)))))


__all__ = ["sun_at"]
