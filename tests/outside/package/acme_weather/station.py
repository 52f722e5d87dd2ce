"""A component of our own."""

from acme_weather.messages import Weather
from regraft import Component, Output, Parameter, every


class Station(Component):
    """Tells the weather."""

    weather = Output(Weather)
    temperature = Parameter(290.0, minimum=0.0, unit="K")

    @every(hz=20)
    def tell(self) -> None:
        """Publish what the thermometer shows."""
        self.weather.publish(Weather(self.kit.now(), self.temperature))
