"""Least squares in many digits: the answers that certified problems are given.

Nothing of the project is used here, and no structure of the equations: the residuals are written
down as the format of certified problems defines them, derivatives are central differences with a
step of 1e-40, and the normal equations are solved with 120 digits, where squaring the condition
does no harm. A problem is what `json` reads from its file with every number as a decimal.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from itertools import combinations
from typing import Any

from mpmath import cos, cospi, mp, mpf, sin, sinpi, sqrt

DIGITS = 120
STEP_EXPONENT = -40
# The steps shrink by some six orders of magnitude each time.
SMALL_STEP = -30
# A slope below this fraction of its row's largest, and a pivot below this one of its column's
# square, are what differences leave of zero.
NO_PIVOT = -60

Number = Any
Vector = list[Number]
Key = tuple[Any, ...]
TRANSLATIONS, ROTATIONS = "XYZ", "ABC"
ZERO_AT_ONE = ("EYX", "EZX", "EZY")


def number(text: str) -> Number:
    """A decimal at full precision, for `json`."""
    with mp.workdps(DIGITS):
        return mpf(text)


@dataclass(frozen=True)
class State:
    """All parameters: machine, balls by artefact, origins and rotations of positions, offsets,
    lengths of standards.
    """

    machine: Vector
    balls: list[list[Vector]]
    origins: list[Vector]
    rotations: list[list[Vector]]
    offsets: list[Vector]
    lengths: list[Number]


@dataclass(frozen=True)
class Row:
    """A whitened residual, as a function of the state, and the parameters that it involves."""

    keys: list[Key]
    value: Any


@dataclass(frozen=True)
class Solution:
    """The state, the sum of squares, parameters in order, what is open, and a generalised
    inverse.
    """

    state: State
    sum_of_squares: Number
    keys: list[Key]
    inverse: dict[Key, dict[Key, Number]] = field(repr=False)
    null: list[dict[Key, Number]] = field(repr=False)
    steps: list[Number] = field(default_factory=list)


@dataclass(frozen=True)
class Function:
    """An error function: its name, the axis that moves, what it displaces along or turns about, its
    coefficients.
    """

    name: str
    axis: int
    component: int
    rotates: bool
    coefficients: int
    zero_at_one: bool

    @property
    def quoted(self) -> int:
        """Number of coefficients of t, t^2, ...; none where nothing but zero is left."""
        return 0 if self.coefficients <= 2 and self.zero_at_one else self.coefficients - 1

    @property
    def free(self) -> int:
        return max(self.coefficients - 1 - self.zero_at_one, 0)


def functions(model: dict[str, Any]) -> tuple[Function, ...]:
    return functions_of(int(model["position_coefficients"]), int(model["rotation_coefficients"]))


@cache
def functions_of(position: int, rotation_: int) -> tuple[Function, ...]:
    """The 18 functions of the kinematic model, translations before rotations."""
    found = []
    for letters, count in ((TRANSLATIONS, position), (ROTATIONS, rotation_)):
        for axis in range(3):
            for component in range(3):
                name = f"E{letters[component]}{TRANSLATIONS[axis]}"
                found.append(
                    Function(
                        name, axis, component, letters == ROTATIONS, count, name in ZERO_AT_ONE
                    )
                )
    return tuple(found)


def machine_names(model: dict[str, Any]) -> list[str]:
    """Names of the quoted parameters: coefficients of t, t^2, ... of each function, or those of the
    metric.
    """
    if model["kind"] == "metric":
        return list(model["parameters"])
    return [f"{f.name} t^{k + 1}" for f in functions(model) for k in range(f.quoted)]


def free_machine(model: dict[str, Any]) -> int:
    """Number of free parameters: a function that is zero at 1 has no linear coefficient of its
    own.
    """
    if model["kind"] == "metric":
        return len(model["parameters"])
    return sum(f.free for f in functions(model))


def quoted(model: dict[str, Any], a: Vector) -> Vector:
    """The quoted parameters of free ones: the linear coefficient makes the function vanish at 1
    where it has to.
    """
    if model["kind"] == "metric":
        return list(a)
    found: Vector = []
    start = 0
    for f in functions(model):
        own = a[start : start + f.free]
        start += f.free
        if f.zero_at_one and own:
            found.append(-sum(own))
        found += own
    return found


def error(problem: dict[str, Any], x: Vector, a: Vector, p: Vector) -> Vector:
    """The correction e(x, a, p)."""
    model = problem["error_model"]
    if model["kind"] == "metric":
        return metric_error(problem, x, a, p)
    lower, upper = problem["volume"]["lower"], problem["volume"]["upper"]
    coefficients = quoted(model, a)
    shift = [[mpf(0)] * 3 for _ in range(3)]
    turn = [[mpf(0)] * 3 for _ in range(3)]
    start = 0
    t = [(c - low) / (high - low) for c, low, high in zip(x, lower, upper, strict=True)]
    for f in functions(model):
        total = mpf(0)
        for c in reversed(coefficients[start : start + f.quoted]):
            total = (total + c) * t[f.axis]
        start += f.quoted
        (turn if f.rotates else shift)[f.axis][f.component] = total
    y = [mpf(0), x[1] - lower[1], mpf(0)]
    z = [mpf(0), mpf(0), x[2] - lower[2]]
    if model["rotations"] == "full":
        tip = list(p)
        for axis in (2, 1, 0):
            tip = multiplied(about_fixed_axes(turn[axis]), tip)
            moved = [mpf(0)] * 3
            moved[axis] = x[axis] - lower[axis]
            tip = [tip[i] + moved[i] + shift[axis][i] for i in range(3)]
        return [tip[i] - (x[i] - lower[i]) for i in range(3)]
    carried = ([y[i] + z[i] + p[i] for i in range(3)], [z[i] + p[i] for i in range(3)], list(p))
    result = list(p)
    for axis in range(3):
        turned = cross(turn[axis], carried[axis])
        result = [result[i] + shift[axis][i] + turned[i] for i in range(3)]
    return result


def metric_error(problem: dict[str, Any], x: Vector, a: Vector, p: Vector) -> Vector:
    """Straight axes: readings less than true lengths by the scale errors, angles that are not
    right.
    """
    names = problem["error_model"]["parameters"]
    value = dict(zip(names, a, strict=True))
    if problem["dimension"] == 2:
        # x = A X, so that X = A^-1 x with A = [[1 + gamma, -alpha], [0, 1]].
        true = [(x[0] + value["alpha"] * x[1]) / (1 + value.get("gamma", mpf(0))), x[1]]
        return [true[i] - x[i] + p[i] for i in range(2)]
    lower = problem["volume"]["lower"]
    c, b, a_ = (value[name] for name in ("C0Y", "B0Z", "A0Z"))
    second = [-sin(c), cos(c), mpf(0)]
    # Unit vector with the stated angles to the first two: its products with them are sin b and -sin
    # a.
    across = (-sin(a_) - sin(b) * second[0]) / second[1]
    third = [sin(b), across, sqrt(1 - sin(b) ** 2 - across**2)]
    axes = ([mpf(1), mpf(0), mpf(0)], second, third)
    true = [mpf(0)] * 3
    for k, name in enumerate(("scale x", "scale y", "scale z")):
        length = (x[k] - lower[k]) * (1 + value[name])
        true = [true[i] + length * axes[k][i] for i in range(3)]
    return [true[i] - (x[i] - lower[i]) + p[i] for i in range(3)]


def cross(u: Vector, v: Vector) -> Vector:
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def multiplied(matrix: list[Vector], v: Vector) -> Vector:
    return [sum((m * c for m, c in zip(row, v, strict=True)), mpf(0)) for row in matrix]


def about_fixed_axes(angles: Vector) -> list[Vector]:
    """Rz Ry Rx, or a single turn in the plane."""
    return rotation([(cos(angle), sin(angle)) for angle in angles])


def drawn_rotation(degrees: Vector) -> list[Vector]:
    """The same for angles in degrees, exact for quarter turns."""
    return rotation([(cospi(angle / 180), sinpi(angle / 180)) for angle in degrees])


def rotation(turns: list[tuple[Number, Number]]) -> list[Vector]:
    if len(turns) == 1:
        [(c, s)] = turns
        return [[c, -s], [s, c]]
    (ca, sa), (cb, sb), (cc, sc) = turns
    return [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]


def turned(rotation: list[Vector], vector: Vector) -> list[Vector]:
    """A rotation followed by a turn about `vector` by its length (Rodrigues), or by an angle in the
    plane.
    """
    if len(vector) == 1:
        turn = about_fixed_axes(vector)
    else:
        angle = sqrt(sum((v * v for v in vector), mpf(0)))
        first = sin(angle) / angle if angle else mpf(1)
        second = (1 - cos(angle)) / angle**2 if angle else mpf(1) / 2
        columns = []
        for k in range(3):
            unit = [mpf(i == k) for i in range(3)]
            once = cross(vector, unit)
            twice = cross(vector, once)
            columns.append([unit[i] + first * once[i] + second * twice[i] for i in range(3)])
        turn = [[columns[k][i] for k in range(3)] for i in range(3)]
    columns = [multiplied(turn, [row[k] for row in rotation]) for k in range(len(rotation))]
    return [[columns[k][i] for k in range(len(rotation))] for i in range(len(rotation))]


def nominal_state(problem: dict[str, Any]) -> State:
    return State(
        [mpf(0)] * free_machine(problem["error_model"]),
        [[list(ball) for ball in artefact["balls"]] for artefact in problem["artefacts"]],
        [list(position["origin"]) for position in problem["positions"]],
        [drawn_rotation(position["rotation_degrees"]) for position in problem["positions"]],
        [list(probe["offset"]) for probe in problem["probes"]],
        [length["nominal"] for length in problem["lengths"]],
    )


def place(problem: dict[str, Any], state: State, position: int, ball: int) -> Vector:
    """Where a ball is in the machine, x = R y + o; of a standard of length l, y is l along its
    direction, or 0.
    """
    number_of = int(problem["positions"][position]["artefact"])
    artefact = problem["artefacts"][number_of]
    if artefact["role"] == "plate":
        own = state.balls[number_of][ball]
    elif artefact["role"] == "gauge":
        azimuth, elevation = (angle / 180 for angle in artefact["directions_degrees"][ball])
        unit = [
            cospi(elevation) * cospi(azimuth),
            cospi(elevation) * sinpi(azimuth),
            sinpi(elevation),
        ]
        own = [state.lengths[0] * c for c in unit]
    else:
        own = [state.lengths[0] * ball, mpf(0), mpf(0)]
    moved = multiplied(state.rotations[position], own)
    return [moved[i] + state.origins[position][i] for i in range(len(moved))]


def error_free(problem: dict[str, Any], state: State) -> list[Vector]:
    """Scale readings of a machine without errors."""
    found = []
    for reading in problem["readings"]:
        at = place(problem, state, int(reading["position"]), int(reading["ball"]))
        p = state.offsets[int(reading["probe"])]
        found.append([at[i] - p[i] for i in range(len(at))])
    return found


def norm(v: Vector) -> Number:
    return sqrt(sum((c * c for c in v), mpf(0)))


def parameters(problem: dict[str, Any]) -> list[Key]:
    """Keys of all free parameters."""
    found: list[Key] = [("machine", k) for k in range(free_machine(problem["error_model"]))]
    for n, artefact in enumerate(problem["artefacts"]):
        if artefact["role"] == "plate":
            found += [
                ("ball", n, j, i)
                for j, ball in enumerate(artefact["balls"])
                for i in range(len(ball))
            ]
    for k, position in enumerate(problem["positions"]):
        found += [("pose", k, c) for c in position["free"]]
    for k, probe in enumerate(problem["probes"]):
        if probe["free"]:
            found += [("offset", k, i) for i in range(len(probe["offset"]))]
    found += [("length", k) for k, length in enumerate(problem["lengths"]) if length["free"]]
    return [tuple(int(part) if isinstance(part, mpf) else part for part in key) for key in found]


def changed(problem: dict[str, Any], state: State, change: dict[Key, Number]) -> State:
    """The state with some parameters changed; rotations are turned about the machine's axes."""
    machine = list(state.machine) if any(key[0] == "machine" for key in change) else state.machine
    balls = [[list(ball) for ball in artefact] for artefact in state.balls]
    origins = [list(origin) for origin in state.origins]
    offsets = state.offsets
    if any(key[0] == "offset" for key in change):
        offsets = [list(offset) for offset in state.offsets]
    lengths = list(state.lengths)
    d = int(problem["dimension"])
    turns: dict[int, Vector] = {}
    for key, value in change.items():
        kind = key[0]
        if kind == "machine":
            machine[key[1]] += value
        elif kind == "ball":
            balls[key[1]][key[2]][key[3]] += value
        elif kind == "pose" and key[2] < d:
            origins[key[1]][key[2]] += value
        elif kind == "pose":
            turns.setdefault(key[1], [mpf(0)] * (3 if d == 3 else 1))[key[2] - d] = value
        elif kind == "offset":
            offsets[key[1]][key[2]] += value
        else:
            lengths[key[1]] += value
    rotations = list(state.rotations)
    for position, turn in turns.items():
        rotations[position] = turned(rotations[position], turn)
    return State(machine, balls, origins, rotations, offsets, lengths)


def rows(problem: dict[str, Any], x: list[Vector]) -> list[Row]:
    """All whitened residuals at scale readings x."""
    known = set(parameters(problem))
    machine = [key for key in known if key[0] == "machine"]
    d = int(problem["dimension"])
    found: list[Row] = []

    def add(keys: list[Key], value: Any) -> None:
        found.append(Row([key for key in keys if key in known], value))

    last: dict[int, tuple[State, Vector]] = {}

    def corrected(state: State, i: int) -> Vector:
        # Most parameters change neither the machine nor the probes, and these lists then are the
        # same.
        if (
            i in last
            and last[i][0].machine is state.machine
            and last[i][0].offsets is state.offsets
        ):
            return last[i][1]
        e = error(problem, x[i], state.machine, state.offsets[int(problem["readings"][i]["probe"])])
        last[i] = state, [x[i][k] + e[k] for k in range(d)]
        return last[i][1]

    for i, reading in enumerate(problem["readings"]):
        position, ball, probe = (int(reading[key]) for key in ("position", "ball", "probe"))
        artefact = int(problem["positions"][position]["artefact"])
        if problem["artefacts"][artefact]["role"] != "plate":
            continue
        involved = [*machine, *(("ball", artefact, ball, k) for k in range(d))]
        involved += [("pose", position, c) for c in range(6)] + [
            ("offset", probe, k) for k in range(d)
        ]

        def of_reading(
            state: State, i: int = i, position: int = position, ball: int = ball
        ) -> Vector:
            at, measured = place(problem, state, position, ball), corrected(state, i)
            return [
                (measured[k] - at[k]) / u
                for k, u in enumerate(problem["readings"][i]["standard_uncertainty"])
            ]

        add(involved, of_reading)
    for item in problem["distances"]:
        n, (i, j) = int(item["artefact"]), (int(ball) for ball in item["balls"])

        def of_distance(
            state: State, item: Any = item, n: int = n, i: int = i, j: int = j
        ) -> Vector:
            apart = [u - v for u, v in zip(state.balls[n][i], state.balls[n][j], strict=True)]
            return [(norm(apart) - item["value"]) / item["standard_uncertainty"]]

        add([("ball", n, b, k) for b in (i, j) for k in range(d)], of_distance)
    for item in problem["coordinates"]:
        key = ("ball", int(item["artefact"]), int(item["ball"]), int(item["axis"]))

        def of_coordinate(state: State, item: Any = item, key: Key = key) -> Vector:
            return [
                (state.balls[key[1]][key[2]][key[3]] - item["value"]) / item["standard_uncertainty"]
            ]

        add([key], of_coordinate)
    for item in problem["measured_lengths"]:
        first, length = int(item["first"]), int(item["length"])
        second = None if item["second"] is None else int(item["second"])
        position = int(problem["readings"][first]["position"])
        involved = [*machine, ("length", length)] + [("pose", position, c) for c in range(d)]

        def of_length(
            state: State, item: Any = item, first: int = first, second: int | None = second, length: int = length,
            position: int = position,
        ) -> Vector:  # fmt: skip
            start = corrected(state, first)
            end = state.origins[position] if second is None else corrected(state, second)
            measured = norm([start[k] - end[k] for k in range(d)])
            return [(measured - state.lengths[length]) / item["standard_uncertainty"]]

        add(involved, of_length)
    for k, item in enumerate(problem["lengths"]):
        if item["free"] and item["standard_uncertainty"] is not None:

            def of_certificate(state: State, k: int = k, item: Any = item) -> Vector:
                return [(state.lengths[k] - item["value"]) / item["standard_uncertainty"]]

            add([("length", k)], of_certificate)
    for k, probe in enumerate(problem["probes"]):
        if probe["free"] and probe["standard_uncertainty"] is not None:
            for i in range(d):

                def of_offset(state: State, k: int = k, i: int = i, probe: Any = probe) -> Vector:
                    return [
                        (state.offsets[k][i] - probe["stated"][i]) / probe["standard_uncertainty"]
                    ]

                add([("offset", k, i)], of_offset)
    for item in problem["priors"]:
        place_of = machine_names(problem["error_model"]).index(item["parameter"])

        def of_prior(state: State, item: Any = item, place_of: int = place_of) -> Vector:
            value = quoted(problem["error_model"], state.machine)[place_of]
            return [(value - item["value"]) / item["standard_uncertainty"]]

        add(machine, of_prior)
    return found


@dataclass(frozen=True)
class Linear:
    """Residuals and derivatives, a dictionary of parameters for each scalar row."""

    residuals: Vector
    derivatives: list[dict[Key, Number]]


def linearised(problem: dict[str, Any], state: State, every: list[Row]) -> Linear:
    step = mpf(10) ** STEP_EXPONENT
    ahead, behind = {}, {}
    for key in parameters(problem):
        ahead[key] = changed(problem, state, {key: step})
        behind[key] = changed(problem, state, {key: -step})
    residuals: Vector = []
    derivatives: list[dict[Key, Number]] = []
    for row in every:
        at = row.value(state)
        own: list[dict[Key, Number]] = [{} for _ in at]
        for key in row.keys:
            high, low = row.value(ahead[key]), row.value(behind[key])
            for i in range(len(at)):
                own[i][key] = (high[i] - low[i]) / (2 * step)
        derivatives += [without_rounding(slopes) for slopes in own]
        residuals += at
    return Linear(residuals, derivatives)


def without_rounding(slopes: dict[Key, Number]) -> dict[Key, Number]:
    """The slopes of a row less what differences leave of zero."""
    least = max((abs(slope) for slope in slopes.values()), default=mpf(0)) * mpf(10) ** NO_PIVOT
    return {key: slope for key, slope in slopes.items() if abs(slope) > least}


def solve(problem: dict[str, Any], state: State, x: list[Vector], most: int) -> Solution:
    """Gauss-Newton from `state` until a step is below 1e-30, at most `most` times; none gives the
    factor there.
    """
    every = rows(problem, x)
    keys = parameters(problem)
    steps: list[Number] = []
    while True:
        linear = linearised(problem, state, every)
        inverse, null = inverted(keys, linear.derivatives)
        if len(steps) == most or (steps and steps[-1] < mpf(10) ** SMALL_STEP):
            break
        gradient = {key: mpf(0) for key in keys}
        for residual, derivative in zip(linear.residuals, linear.derivatives, strict=True):
            for key, slope in derivative.items():
                gradient[key] += slope * residual
        change = {
            key: -sum((row[other] * gradient[other] for other in row), mpf(0))
            for key, row in inverse.items()
        }
        steps.append(max(abs(value) for value in change.values()))
        state = changed(problem, state, change)
    total = sum((residual**2 for residual in linear.residuals), mpf(0))
    return Solution(state, total, keys, inverse, null, steps)


def inverted(
    keys: list[Key], derivatives: list[dict[Key, Number]]
) -> tuple[dict[Key, dict[Key, Number]], list[dict[Key, Number]]]:
    """A generalised inverse of the normal matrix, and its null vectors, by elimination of the
    largest pivots.
    """
    place_of = {key: i for i, key in enumerate(keys)}
    n = len(keys)
    normal = [[mpf(0)] * n for _ in range(n)]
    for derivative in derivatives:
        entries = [(place_of[key], slope) for key, slope in derivative.items()]
        for i, left in entries:
            own = normal[i]
            for j, right in entries:
                if j <= i:
                    own[j] += left * right
    for i in range(n):
        for j in range(i):
            normal[j][i] = normal[i][j]
    size = [normal[i][i] for i in range(n)]
    # The lower part grows into the inverse of the unit triangular factor.
    work = [[*normal[i], *(mpf(i == j) for j in range(n))] for i in range(n)]
    left = list(range(n))
    used: list[int] = []
    while left:
        pivot = max(left, key=lambda i: work[i][i] / size[i] if size[i] else mpf(0))
        if not size[pivot] or work[pivot][pivot] < size[pivot] * mpf(10) ** NO_PIVOT:
            break
        left.remove(pivot)
        used.append(pivot)
        row = work[pivot]
        scale = 1 / row[pivot]
        row[:] = [value * scale if value else value for value in row]
        for i in range(n):
            factor = work[i][pivot]
            if i != pivot and factor:
                own = work[i]
                for j in range(2 * n):
                    if row[j]:
                        own[j] -= factor * row[j]
    null = []
    for free in left:
        vector = {keys[free]: mpf(1)}
        vector.update({keys[i]: -work[i][free] for i in used})
        null.append(vector)
    inverse = {
        keys[i]: {keys[j]: work[i][n + j] for j in used} if i not in left else {} for i in range(n)
    }
    return inverse, null


def spread(solution: Solution, rows_: list[dict[Key, Number]]) -> list[Number | None]:
    """Standard uncertainties of linear functions for sigma = 1; None where a null vector changes
    one.
    """
    found: list[Number | None] = []
    for row in rows_:
        size = norm(list(row.values()))
        if any(
            abs(sum((c * vector.get(key, 0) for key, c in row.items()), mpf(0)))
            > mpf(10) ** -30 * size * norm(list(vector.values()))
            for vector in solution.null
        ):
            found.append(None)
            continue
        total = mpf(0)
        for key, c in row.items():
            if c:
                own = solution.inverse[key]
                total += c * sum(
                    (own.get(other, mpf(0)) * e for other, e in row.items() if e), mpf(0)
                )
        found.append(sqrt(total))
    return found


def summary(values: list[Number | None]) -> dict[str, Any]:
    known = [value for value in values if value is not None]
    is_determined = bool(known) and len(known) == len(values)
    return {
        "maximum": max(known) if is_determined else None,
        "average": sum(known, mpf(0)) / len(known) if is_determined else None,
        "count": len(values),
        "undetermined": len(values) - len(known),
    }


def uncertainties(problem: dict[str, Any], solution: Solution) -> dict[str, dict[str, Any]]:
    """U1 to U6, for the stated uncertainties."""
    model, state, d = problem["error_model"], solution.state, int(problem["dimension"])
    machine = [key for key in solution.keys if key[0] == "machine"]
    functions_of: dict[str, list[dict[Key, Number]]] = {
        symbol: [] for symbol in ("U1", "U2", "U3", "U4", "U5", "U6")
    }
    functions_of["U1"] = [{key: mpf(1)} for key in solution.keys if key[0] == "ball"]
    functions_of["U2"] = [{key: mpf(1)} for key in solution.keys if key[0] == "pose"]
    units = [[mpf(i == k) for i in range(len(machine))] for k in range(len(machine))]
    columns = [quoted(model, unit) for unit in units]
    for place_of in range(len(machine_names(model))):
        functions_of["U3"].append({key: columns[k][place_of] for k, key in enumerate(machine)})
    for n, artefact in enumerate(problem["artefacts"]):
        if artefact["role"] == "plate":
            for i, j in combinations(range(len(artefact["balls"])), 2):
                apart = [u - v for u, v in zip(state.balls[n][i], state.balls[n][j], strict=True)]
                length = norm(apart)
                row = {("ball", n, i, k): apart[k] / length for k in range(d)}
                row.update({("ball", n, j, k): -apart[k] / length for k in range(d)})
                functions_of["U5"].append(row)
    p = state.offsets[int(problem["point_probe"])]
    places, slopes = [], []
    step = mpf(10) ** STEP_EXPONENT
    for x in problem["points"]:
        e = error(problem, x, state.machine, p)
        places.append([x[k] + e[k] for k in range(d)])
        slopes.append(by_parameters(problem, solution, x, p, step))
    functions_of["U4"] = [row for point in slopes for row in point]
    for i, j in combinations(range(len(places)), 2):
        apart = [u - v for u, v in zip(places[i], places[j], strict=True)]
        length = norm(apart)
        row = {}
        for sign, point in ((1, slopes[i]), (-1, slopes[j])):
            for k in range(d):
                for key, slope in point[k].items():
                    row[key] = row.get(key, mpf(0)) + sign * apart[k] / length * slope
        functions_of["U6"].append(row)
    return {
        symbol: summary(spread(solution, found)) for symbol, found in functions_of.items() if found
    }


def by_parameters(
    problem: dict[str, Any], solution: Solution, x: Vector, p: Vector, step: Number
) -> list[dict[Key, Number]]:
    """Derivatives of the correction at a point, by machine parameters and by the offset of the
    points' probe.
    """
    d, probe = int(problem["dimension"]), int(problem["point_probe"])
    found: list[dict[Key, Number]] = [{} for _ in range(d)]
    for key in solution.keys:
        if key[0] != "machine" and key[:2] != ("offset", probe):
            continue
        ends = []
        for sign in (1, -1):
            a, offset = list(solution.state.machine), list(p)
            if key[0] == "machine":
                a[key[1]] += sign * step
            else:
                offset[key[2]] += sign * step
            ends.append(error(problem, x, a, offset))
        for k in range(d):
            found[k][key] = (ends[0][k] - ends[1][k]) / (2 * step)
    return found


def as_drawn(problem: dict[str, Any]) -> Solution:
    """The factor of a machine without errors in the nominal poses."""
    state = nominal_state(problem)
    return solve(problem, state, error_free(problem, state), 0)


def estimate(problem: dict[str, Any], start: State) -> Solution:
    return solve(problem, start, [list(reading["x"]) for reading in problem["readings"]], 20)


def with_readings(problem: dict[str, Any], x: list[Vector]) -> dict[str, Any]:
    told = [
        {**reading, "x": values} for reading, values in zip(problem["readings"], x, strict=True)
    ]
    return {**problem, "readings": told}


def without_error(problem: dict[str, Any], state: State, target: list[Vector]) -> list[Vector]:
    """Scale readings x with x + e(x, a, p) = target: an iteration that gains five digits each
    time.
    """
    found = []
    for reading, place_ in zip(problem["readings"], target, strict=True):
        p = state.offsets[int(reading["probe"])]
        x = [place_[k] - p[k] for k in range(len(place_))]
        for _ in range(200):
            e = error(problem, x, state.machine, p)
            new = [place_[k] - e[k] for k in range(len(place_))]
            done = max(abs(new[k] - x[k]) for k in range(len(x))) < mpf(10) ** -100
            x = new
            if done:
                break
        found.append(x)
    return found
