# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The command ``geomsrv``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

__all__ = ["main"]

# What follows these is handed on as it is: ROS has its own syntax (--ros-args -p name:=value).
PASSED_ON = ("node", "demo")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="geomsrv", description="Geometry queries for robots that state how accurate they are."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {_version()}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")
    commands.add_parser(
        "node", help="run the ROS 2 node; takes ROS arguments, as --ros-args -p max_rate:=50.0", add_help=False
    )
    commands.add_parser("demo", help="a real robot, a node and a client; writes a picture", add_help=False)
    commands.add_parser("self-check", help="answer built-in hard cases and report; needs no ROS")
    verify = commands.add_parser("verify", help="prove recorded answers in exact arithmetic; needs no ROS")
    verify.add_argument("files", nargs="+", metavar="FILE", help="certificates as JSON, one a line")

    crosscheck = commands.add_parser("crosscheck", help="our answers beside those of FCL and Coal; needs no ROS")
    which = crosscheck.add_mutually_exclusive_group(required=True)
    which.add_argument("--hard", action="store_true", help="the hard cases, at every tier")
    which.add_argument("--motion", type=int, metavar="N", help="first contacts of N random moving bodies, through FCL")
    crosscheck.add_argument("--cases", type=Path, metavar="FILE", help="JSON lines, by default those installed")
    crosscheck.add_argument("--verbose", action="store_true", help="name every wrong answer of FCL and Coal, too")

    price = commands.add_parser("price", help="what accuracy costs here: error and time of every way to answer a query")
    price.add_argument("--quick", action="store_true", help="fewer items, fewer turns: rough figures in two minutes")
    price.add_argument("--only", default="", metavar="TEXT", help="queries whose name holds these words")
    price.add_argument("--json", type=Path, metavar="FILE", help="also write the figures here; --explain reads them")
    price.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        default=Path("price_output"),
        help="where pictures and pages go (%(default)s)",
    )
    price.add_argument("--page", type=Path, metavar="FILE", help="also write a Markdown page that shows the pictures")
    price.add_argument(
        "--explain", metavar="REQUEST", help="what would run, and its price: 'distance box-capsule 1e-6'"
    )

    arguments = list(sys.argv[1:] if argv is None else argv)
    command, rest = arguments[:1], arguments[1:]
    if not (command and command[0] in PASSED_ON):
        given = parser.parse_args(arguments)
        if given.command == "crosscheck" and given.motion is not None:
            return _crosscheck_motion(given.motion)
        if given.command == "crosscheck":
            return _crosscheck([given.cases] if given.cases else None, given.verbose)
        if given.command == "price":
            return _price(given)
        return _verify(given.files) if given.command == "verify" else _self_check()
    if command == ["demo"]:
        from geomsrv import demo

        return demo.main(rest)
    try:
        from geomsrv.ros import node
    except ModuleNotFoundError as missing:
        print(f"geomsrv node needs ROS 2, and {missing.name} is not installed", file=sys.stderr)
        return 2
    return node.main(rest)


def _version() -> str:
    from geomsrv._version import __version__

    return str(__version__)


def _self_check() -> int:
    from geomsrv.selfcheck import self_check

    report = self_check()
    print(report.message)
    return 0 if report.ok else 1


def _crosscheck(files: Sequence[Path] | None, verbose: bool) -> int:
    from geomsrv.errors import GeometryError
    from geomsrv.hard_cases import read, shipped
    from geomsrv.hard_check import TIERS, check

    files = shipped() if files is None else files
    if not files:
        print("geomsrv crosscheck: the cases are not installed; name a file with --cases", file=sys.stderr)
        return 2
    try:
        report = check(case for file in files for case in read(file))
    except (OSError, GeometryError) as error:
        print(f"geomsrv crosscheck: {error}", file=sys.stderr)
        return 2
    print(report.text())
    for line in report.wrong:
        ours = line.partition(":")[0] in TIERS
        if ours or verbose:
            print(f"{'WRONG ' if ours else ''}{line}")
    return 1 if report.engine_wrong else 0


def _crosscheck_motion(count: int) -> int:
    from geomsrv.motion_check import VERDICTS, cross_check_motion, random_scene

    if count < 2:
        print(f"geomsrv crosscheck: --motion must be at least 2, got {count}", file=sys.stderr)
        return 2
    tally = cross_check_motion(random_scene(0, count), 2.0)
    for kind, counts in sorted(tally.kinds.items()):
        print(f"{kind:16}" + "".join(f"  {counts[verdict]:6} {verdict}" for verdict in VERDICTS if counts[verdict]))
    print(tally.summary())
    return 1 if tally.total("engine_wrong") else 0


def _price(given: argparse.Namespace) -> int:
    from geomsrv.errors import GeometryError
    from geomsrv.price import run

    try:
        return run(given.only, given.quick, given.out, given.json, given.page, given.explain, _version())
    except ModuleNotFoundError as missing:
        print(f"geomsrv price needs {missing.name}: pip install rich matplotlib", file=sys.stderr)
    except (OSError, GeometryError) as error:
        print(f"geomsrv price: {error}", file=sys.stderr)
    return 2


SHOWN = 3  # failures that are told one by one


def _verify(files: Sequence[str]) -> int:
    from geomsrv.verify import verify_lines

    records, empty, failures = 0, 0, []
    for name in files:
        try:
            with open(name, encoding="utf-8") as file:
                for line, claims, fault in verify_lines(file):
                    records += 1
                    empty += not claims
                    if fault:
                        failures.append(f"{name}:{line}: {fault}")
        except (OSError, UnicodeDecodeError) as fault:
            print(f"geomsrv verify: cannot read {name}: {fault}", file=sys.stderr)
            return 2
    proven = records - empty - len(failures)
    without = f", {empty} claim nothing" if empty else ""
    first = "; ".join(failures[:SHOWN]) + ("; ..." if len(failures) > SHOWN else "")
    print(f"{records} records: {proven} proven{without}, {len(failures)} failed" + (f": {first}" if first else ""))
    return 1 if failures else 0
