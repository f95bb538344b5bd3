"""Print the table of docs/trust.md: ``python -m benches.trust [--share 0.1] [FAMILY ...]``."""

import argparse

from benches.trust import (
    built_in_surfaces,
    cone_histories,
    control,
    degenerate_nearest,
    degenerate_regions,
    feet_and_pinches,
    global_bounds,
    history_free,
    large_forces,
    limited_sums,
    mesh_unions,
    metrics,
    near_closure,
    nearest,
    nearly_degenerate,
    origin_contacts,
    priced,
    separable_bounds,
    smooth,
    support_regions,
    symmetric_cones,
    tumbles,
)

FAMILIES = (
    control,
    priced,
    nearest,
    degenerate_nearest,
    nearly_degenerate,
    feet_and_pinches,
    large_forces,
    limited_sums,
    origin_contacts,
    tumbles,
    history_free,
    cone_histories,
    metrics,
    near_closure,
    smooth,
    symmetric_cones,
    global_bounds,
    separable_bounds,
    built_in_surfaces,
    mesh_unions,
    support_regions,
    degenerate_regions,
)


def main() -> None:
    """Print the rows of the named families, or of all."""
    names = [family.__name__.rpartition(".")[2] for family in FAMILIES]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="share of the cases of each family")
    parser.add_argument("families", nargs="*", metavar="FAMILY", help=", ".join(names))
    given = parser.parse_args()
    if unknown := set(given.families) - set(names):
        parser.error(f"no family {', '.join(sorted(unknown))}")
    print("| family | cases | oracle | missed | wrong |")
    print("|---|---|---|---|---|")
    for name, family in zip(names, FAMILIES, strict=True):
        if given.families and name not in given.families:
            continue
        for row in family.rows(given.share):
            print(f"| {row.family} | {row.cases:,} | {row.oracle} | {row.missed} | {row.wrong} |", flush=True)


if __name__ == "__main__":
    main()
