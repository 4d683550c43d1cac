"""Tableaux of explicit Runge-Kutta methods.

The dense output of fixed-step methods up to order 4 is the cubic Hermite polynomial, which has the order of
the methods. ``rk5`` has the dense output of Dormand and Prince.
"""

from __future__ import annotations

from armblocks.integration.butcher_tableau import ButcherTableau, hermite_dense

EULER = ButcherTableau(
    name="euler",
    aliases=("ode1",),
    title="Euler",
    source="Euler 1768; Hairer, Norsett, Wanner I, I.7",
    order=1,
    dense_order=1,
    nodes=(0.0,),
    matrix=((),),
    weights=(1.0,),
    dense=hermite_dense((1.0,)),
)

HEUN = ButcherTableau(
    name="heun",
    aliases=("ode2", "rk2"),
    title="Heun, the improved Euler method",
    source="Heun 1900; Hairer, Norsett, Wanner I, II.1",
    order=2,
    dense_order=2,
    nodes=(0.0, 1.0),
    matrix=((), (1.0,)),
    weights=(1 / 2, 1 / 2),
    dense=hermite_dense((1 / 2, 1 / 2)),
)

_BS_NODES = (0.0, 1 / 2, 3 / 4)
_BS_MATRIX = ((), (1 / 2,), (0.0, 3 / 4))
_BS_WEIGHTS = (2 / 9, 1 / 3, 4 / 9)
_BS_SOURCE = "Bogacki, Shampine: A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989) 321-325"

RK3 = ButcherTableau(
    name="rk3",
    aliases=("ode3",),
    title="Bogacki-Shampine, fixed step",
    source=_BS_SOURCE,
    order=3,
    dense_order=3,
    nodes=_BS_NODES,
    matrix=_BS_MATRIX,
    weights=_BS_WEIGHTS,
    dense=hermite_dense(_BS_WEIGHTS),
)

RK23 = ButcherTableau(
    name="rk23",
    aliases=("ode23", "bogacki-shampine"),
    title="Bogacki-Shampine 3(2)",
    source=_BS_SOURCE,
    order=3,
    dense_order=3,
    nodes=_BS_NODES,
    matrix=_BS_MATRIX,
    weights=_BS_WEIGHTS,
    error=(5 / 72, -1 / 12, -1 / 9, 1 / 8),
    error_order=2,
    dense=hermite_dense(_BS_WEIGHTS),
)

RK4 = ButcherTableau(
    name="rk4",
    aliases=("ode4",),
    title="the classical Runge-Kutta method",
    source="Kutta 1901; Hairer, Norsett, Wanner I, II.1, table 1.2",
    order=4,
    dense_order=4,
    nodes=(0.0, 1 / 2, 1 / 2, 1.0),
    matrix=((), (1 / 2,), (0.0, 1 / 2), (0.0, 0.0, 1.0)),
    weights=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
    dense=hermite_dense((1 / 6, 1 / 3, 1 / 3, 1 / 6)),
)

_DP_NODES = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)
_DP_MATRIX = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
)
_DP_WEIGHTS = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
_DP_DENSE = (
    (1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432),
    (0.0, 0.0, 0.0, 0.0),
    (0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799),
    (0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072),
    (0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632),
    (0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844),
    (0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423),
)
_DP_SOURCE = (
    "Dormand, Prince: A family of embedded Runge-Kutta formulae, J. Comp. Appl. Math. 6 (1980) 19-26; "
    "dense output of Shampine: Some practical Runge-Kutta formulas, Math. Comp. 46 (1986) 135-150"
)

RK5 = ButcherTableau(
    name="rk5",
    aliases=("ode5",),
    title="Dormand-Prince, fixed step",
    source=_DP_SOURCE,
    order=5,
    dense_order=5,
    nodes=_DP_NODES,
    matrix=_DP_MATRIX,
    weights=_DP_WEIGHTS,
    dense=_DP_DENSE,
)

RK45 = ButcherTableau(
    name="rk45",
    aliases=("ode45", "dopri5", "dormand-prince"),
    title="Dormand-Prince 5(4)",
    source=_DP_SOURCE,
    order=5,
    dense_order=5,
    nodes=_DP_NODES,
    matrix=_DP_MATRIX,
    weights=_DP_WEIGHTS,
    error=(-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40),
    error_order=4,
    dense=_DP_DENSE,
)

TSIT5 = ButcherTableau(
    name="tsit5",
    aliases=("tsitouras",),
    title="Tsitouras 5(4)",
    source=(
        "Tsitouras: Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying assumption, "
        "Comput. Math. Appl. 62 (2011) 770-775; the interpolant of its section 4 in powers of theta"
    ),
    order=5,
    dense_order=5,
    nodes=(0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0),
    matrix=(
        (),
        (0.161,),
        (-0.008480655492356989, 0.335480655492357),
        (2.8971530571054935, -6.359448489975075, 4.3622954328695815),
        (5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525),
        (5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383),
    ),
    weights=(
        0.09646076681806523,
        0.01,
        0.4798896504144996,
        1.379008574103742,
        -3.290069515436081,
        2.324710524099774,
    ),
    error=(
        0.0017800110522257714,
        0.0008164344596567469,
        -0.007880878010261995,
        0.1447110071732629,
        -0.5823571654525552,
        0.45808210592918697,
        -0.015151515151515152,
    ),
    error_order=4,
    dense=(
        (1.0, -2.763706197274826, 2.9132554618219126, -1.0530884977290216),
        (0.0, 0.13169999999999998, -0.2234, 0.1017),
        (0.0, 3.9302962368947516, -5.941033872131505, 2.490627285651253),
        (0.0, -12.411077166933676, 30.33818863028232, -16.548102889244902),
        (0.0, 37.50931341651104, -88.1789048947664, 47.37952196281928),
        (0.0, -27.896526289197286, 65.09189467479366, -34.87065786149661),
        (0.0, 1.5, -4.0, 2.5),
    ),
)
