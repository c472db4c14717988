"""Differences of distances, as a user states values of his own."""

import numpy as np


class DiagonalDifference:
    """How much longer one distance is than another, both between corners."""

    unit = "m"

    def __init__(self, names, ends):
        self.names, self.ends = names, ends

    def values(self, balls):
        length = np.linalg.norm(balls[self.ends[:, :, 0]] - balls[self.ends[:, :, 1]], axis=2)
        return length[:, 0] - length[:, 1]

    def derivatives(self, balls):
        result = np.zeros((len(self.ends), *balls.shape))
        for k, pairs in enumerate(self.ends):
            for sign, (one, other) in zip((1.0, -1.0), pairs, strict=True):
                along = balls[one] - balls[other]
                along = sign * along / np.linalg.norm(along)
                result[k, one] += along
                result[k, other] -= along
        return result


def build(names, balls, pairs):
    ends = np.array([[[names.index(ball) for ball in pair] for pair in two] for two in pairs])
    return DiagonalDifference(tuple(("-".join(one), "-".join(other)) for one, other in pairs), ends)
