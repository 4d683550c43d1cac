"""Stiff problems of the Bari test set as diagrams, compared with the published end values."""

from __future__ import annotations

import re

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Expression, Integrator, Mux

HIRES = (
    "-1.71*u[1] + 0.43*u[2] + 8.32*u[3] + 0.0007",
    "1.71*u[1] - 8.75*u[2]",
    "-10.03*u[3] + 0.43*u[4] + 0.035*u[5]",
    "8.32*u[2] + 1.71*u[3] - 1.12*u[4]",
    "-1.745*u[5] + 0.43*u[6] + 0.43*u[7]",
    "-280*u[6]*u[8] + 0.69*u[4] + 1.71*u[5] - 0.43*u[6] + 0.69*u[7]",
    "280*u[6]*u[8] - 1.81*u[7]",
    "-280*u[6]*u[8] + 1.81*u[7]",
)
HIRES_END = (
    0.0007371312573325668,
    0.0001442485726316185,
    5.888729740967575e-05,
    0.001175651343283149,
    0.002386356198831331,
    0.006238968252742796,
    0.002849998395185769,
    0.002850001604814231,
)
OREGONATOR = (
    "77.27*(u[2] + u[1]*(1 - 8.375e-6*u[1] - u[2]))",
    "(u[3] - (1 + u[1])*u[2])/77.27",
    "0.161*(u[1] - u[3])",
)
OREGONATOR_END = (0.1000814870318523e1, 0.1228178521549917e4, 0.1320554942846706e3)


def pollution() -> tuple[str, ...]:
    """25 reactions of 20 substances, with the reactions that produce (+) and consume (-) each substance."""
    rates = (
        0.35,
        26.6,
        12300.0,
        0.00086,
        0.00082,
        15000.0,
        0.00013,
        24000.0,
        16500.0,
        9000.0,
        0.022,
        12000.0,
        1.88,
        16300.0,
        4800000.0,
        0.00035,
        0.0175,
        100000000.0,
        444000000000.0,
        1240.0,
        2.1,
        5.78,
        0.0474,
        1780.0,
        3.12,
    )
    reactants = (
        (1,),
        (2, 4),
        (5, 2),
        (7,),
        (7,),
        (7, 6),
        (9,),
        (9, 6),
        (11, 2),
        (11, 1),
        (13,),
        (10, 2),
        (14,),
        (1, 6),
        (3,),
        (4,),
        (4,),
        (16,),
        (16,),
        (17, 6),
        (19,),
        (19,),
        (1, 4),
        (19, 1),
        (20,),
    )
    balance = (
        "-1-10-14-23-24+2+3+9+11+12+22+25",
        "-2-3-9-12+1+21",
        "-15+1+17+19+22",
        "-2-16-17-23+15",
        "-3+4+4+6+7+13+20",
        "-6-8-14-20+3+18+18",
        "-4-5-6+13",
        "+4+5+6+7",
        "-7-8",
        "-12+7+9",
        "-9-10+8+11",
        "+9",
        "-11+10",
        "-13+12",
        "+14",
        "-18-19+16",
        "-20",
        "+20",
        "-21-22-24+23+25",
        "-25+24",
    )
    terms = [f"({k!r}*" + "*".join(f"u[{j}]" for j in species) + ")" for k, species in zip(rates, reactants)]
    return tuple(
        "".join(sign + terms[int(number) - 1] for sign, number in re.findall(r"([+-])(\d+)", row))
        for row in balance
    )


POLLUTION_START = (0.0, 0.2, 0.0, 0.04, 0.0, 0.0, 0.1, 0.3, 0.01) + (0.0,) * 7 + (0.007, 0.0, 0.0, 0.0)
POLLUTION_END = (
    0.05646255480022769,
    0.1342484130422339,
    4.139734331099427e-09,
    0.005523140207484359,
    2.018977262302196e-07,
    1.464541863493966e-07,
    0.07784249118997964,
    0.3245075353396018,
    0.007494013383880406,
    1.622293157301561e-08,
    1.135863833257075e-08,
    0.002230505975721359,
    0.000208716288279863,
    1.396921016840158e-05,
    0.008964884856898295,
    4.352846369330103e-18,
    0.006899219696263405,
    0.0001007803037365946,
    1.772146513969984e-06,
    5.682943292316392e-05,
)


def equations(rates: tuple[str, ...], start: tuple[float, ...]) -> ab.Diagram:
    builder = ab.DiagramBuilder("stiff")
    y = builder.add("y", Integrator(initial=start))
    parts = [builder.add(f"f{k}", Expression(formula=rate), y) for k, rate in enumerate(rates)]
    builder.connect(builder.add("rates", Mux(inputs=len(parts)), *parts), y["u"])
    return builder.build()


@pytest.mark.parametrize("solver", ["auto", "rodas5p"])
@pytest.mark.parametrize(
    ("diagram", "stop", "end", "atol"),
    [
        (equations(HIRES, (1.0,) + (0.0,) * 6 + (0.0057,)), 321.8122, HIRES_END, 1e-12),
        (equations(OREGONATOR, (1.0, 2.0, 3.0)), 360.0, OREGONATOR_END, 1e-9),
        (equations(pollution(), POLLUTION_START), 60.0, POLLUTION_END, 1e-11),
    ],
    ids=["HIRES", "OREGO", "pollution"],
)
def test_end_values_agree_with_the_published_ones(
    diagram: ab.Diagram, stop: float, end: tuple[float, ...], atol: float, solver: str
) -> None:
    """The mixed error of the test set is a small multiple of rtol = 1e-7 after some hundred steps."""
    rtol = 1e-7
    result = ab.simulate(diagram, stop_time=stop, rtol=rtol, atol=atol, solver=solver)
    error = np.abs(result["y"][-1] - np.array(end)) / (atol / rtol + np.abs(end))
    assert error.max() < 10 * rtol


E5 = (
    "-7.89e-10*u[1] - 1.1e7*u[1]*u[3]",
    "7.89e-10*u[1] - 1.13e9*u[2]*u[3]",
    "7.89e-10*u[1] - 1.1e7*u[1]*u[3] + 1.13e3*u[4] - 1.13e9*u[2]*u[3]",
    "1.1e7*u[1]*u[3] - 1.13e3*u[4]",
)
"""Enright, Hull, Lindberg 1975; end time of Hairer and Wanner, *Solving ODEs II*, section IV.10."""
E5_AT_10 = (1.7599259497677897e-3, 1.3846281519376516e-11, 7.6370038530073912e-13, 1.3082581134075777e-11)


def test_e5_is_integrated_until_only_rounding_errors_remain() -> None:
    diagram = equations(E5, (1.76e-3, 0.0, 0.0, 0.0))
    settings = {"rtol": 1e-9, "atol": 1e-24, "solver": "rodas5p"}
    early = ab.simulate(diagram, stop_time=10.0, **settings)["y"][-1]
    assert early == pytest.approx(E5_AT_10, rel=1e-8)
    # y2 = y3 + y4 holds exactly, but rates of 1e-7 1/s have rounding errors of 1e-23 1/s, integrated over
    # steps of hundreds of seconds: about 1e-21 of y2 remains, with SciPy's Radau and BDF as well.
    final = ab.simulate(diagram, stop_time=1e13, **settings)["y"][-1]
    assert np.abs(final).max() < 1e-19
    assert abs(final[1] - final[2] - final[3]) < 1e-19
