"""One tip target, five joints: each constraint has branches of its own.

    python3 demos/02_inverse_kinematics_and_its_branches.py

Learn: a target with a pitch leaves one freedom. A constraint takes it away and leaves up to four
branches, each with the limits that it breaks; a constraint that chooses looks over the whole
family, and says how good its choice is.
"""

import numpy as np

from boom_model import Boom, forward_kinematics, inverse_kinematics
from boom_model.kinematics.constraints import parse_constraint

TARGET = (1.4, 0.0, 1.0)


def main() -> None:
    boom = Boom.load()
    for name in ("horizontal", "extension=0.25", "actuator=-20", "least-extension", "least-torque"):
        found = inverse_kinematics(boom, TARGET, pitch=-np.pi / 2.0, constraint=parse_constraint(name))
        print(f"constraint {name}: {len(found.solutions)} branch(es)")
        for i, solution in enumerate(found.solutions):
            q = np.where([0, 0, 0, 1, 0], solution.q, np.degrees(solution.q))
            why = "within the limits" if solution.within_limits else "; ".join(solution.reasons)
            best = " <- best" if i == found.best else ""
            print(f"  {np.array2string(q, precision=2, suppress_small=True)} {why}{best}")
        for solution in found.solutions:
            miss = np.linalg.norm(forward_kinematics(boom, solution.q).position - TARGET)
            assert miss < 1e-12, miss


if __name__ == "__main__":
    main()
