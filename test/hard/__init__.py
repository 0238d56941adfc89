# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""Hard cases by class: generators of inputs, the exact answers to them, and the table of who answers them right.

A case is a dict in the layout of data/hard_cases.jsonl, numbers as floats: kind, class, input.  One module per
query kind, one function per class; each takes a seeded `random.Random` and returns one input.  The numbers are
judged as they come out, whatever rounding did to them, so a generator aims and need not hit.
"""
