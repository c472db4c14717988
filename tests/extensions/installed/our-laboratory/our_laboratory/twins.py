"""A kind whose layout contradicts itself."""

from typing import Literal

from ballplate.simulator.geometry import ArtefactSettings, BallLayout, frozen


class TwinsSettings(ArtefactSettings):
    kind: Literal["twins"]

    def layout(self) -> BallLayout:
        return BallLayout(("a", "a"), frozen([[0, 0, 0], [1, 0, 0]]))


SETTINGS = TwinsSettings
