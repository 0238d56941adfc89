# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 side: `node` speaks ROS, everything else here is pure Python that can be tested without it."""
