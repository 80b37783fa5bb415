# SPDX-License-Identifier: MIT
"""The estimator once more, written plainly in NumPy straight from the paper, to compare with.

Shares no code with the package: its own interpolation, exponential map and solver.
"""

from dataclasses import dataclass

import numpy as np


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def exp_se3(xi):
    """SE(3) exponential of [rotation, translation], summed as a power series of the 4x4 matrix."""
    A = np.zeros((4, 4))
    A[:3, :3], A[:3, 3] = skew(xi[:3]), xi[3:]
    term, total = np.eye(4), np.eye(4)
    for n in range(1, 40):
        term = term @ A / n
        total = total + term
    return total


def log_se3(T):
    """Inverse of ``exp_se3`` for angles below pi."""
    R, t = T[:3, :3], T[:3, 3]
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine, cosine = np.linalg.norm(axis), (np.trace(R) - 1) / 2
    angle = np.arctan2(sine, cosine)
    omega = axis * (angle / sine if sine > 1e-9 else 1.0)
    W = skew(omega)
    if angle < 1e-4:
        factor = 1 / 12 + angle**2 / 720
    else:
        factor = 1 / angle**2 - (1 + np.cos(angle)) / (2 * angle * np.sin(angle))
    return np.concatenate([omega, (np.eye(3) - W / 2 + factor * W @ W) @ t])


def distance(values, lower, upper, points):
    """Trilinear signed distance (N,) and gradient (N, 3), as a sum over the eight corners."""
    shape = np.array(values.shape)
    cell = (upper - lower) / (shape - 1)
    clamped = np.clip(points, lower, upper)
    u = (clamped - lower) / cell
    base = np.clip(np.floor(u).astype(int), 0, shape - 2)
    f = u - base
    phi, gradient = np.zeros(len(points)), np.zeros((len(points), 3))
    for corner in np.ndindex(2, 2, 2):
        corner = np.array(corner)
        node = values[tuple((base + corner).T)].astype(float)
        weight = np.where(corner, f, 1 - f)
        slope = np.where(corner, 1.0, -1.0) / cell
        phi += node * weight.prod(axis=1)
        for axis in range(3):
            others = [a for a in range(3) if a != axis]
            gradient[:, axis] += node * slope[axis] * weight[:, others].prod(axis=1)
    offset = points - clamped
    outside = np.linalg.norm(offset, axis=1)
    beyond = outside > 0
    gradient[offset != 0] = 0
    gradient[beyond] += offset[beyond] / outside[beyond, None]
    return phi + outside, gradient


@dataclass
class Problem:
    """One frame, all in arrays; ``w_vis`` is (rotation, translation)."""

    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    pads: list  # each (M, 3), pad frame
    T_wp: np.ndarray
    contacts: np.ndarray
    T_visual: np.ndarray
    w_vis: tuple = (1.0, 1.0)
    w_tac: float = 1.0
    w_pen: float = 1.0
    log_theta_vis: float = -6.5
    log_theta_tac: float = 0.0

    def closest(self, T):
        """Distance (K,), Jacobian (K, 6), and point in the object frame (K, 3) of each pad."""
        T_inv = np.linalg.inv(T)
        rows = []
        for points, T_wp in zip(self.pads, self.T_wp, strict=True):
            T_op = T_inv @ T_wp
            points_o = points @ T_op[:3, :3].T + T_op[:3, 3]
            phi, _ = distance(self.values, self.lower, self.upper, points_o)
            best = int(np.argmin(phi))
            p = points_o[best]
            _, gradient = distance(self.values, self.lower, self.upper, p[None])
            rows.append((phi[best], np.concatenate([np.cross(gradient[0], p), -gradient[0]]), p))
        phi, J, p = zip(*rows, strict=True)
        return np.array(phi), np.array(J), np.array(p)

    def terms(self, T):
        """All (residual, Jacobian, weight per row, log theta or None) blocks, each under one loss."""
        weights = np.repeat(self.w_vis, 3)
        r = log_se3(np.linalg.inv(T) @ self.T_visual)
        blocks = [(r, self._visual_jacobian(T), weights, self.log_theta_vis)]
        phi, J, _ = self.closest(T)
        for k in np.flatnonzero(self.contacts):
            on = float(phi[k] > 0)
            blocks.append((on * phi[[k]], on * J[[k]], np.array([self.w_tac]), self.log_theta_tac))
        inside = phi < 0
        blocks.append((phi * inside, J * inside[:, None], np.full(len(phi), self.w_pen), None))
        return blocks

    def _visual_jacobian(self, T, step=1e-6):
        def residual(xi):
            return log_se3(np.linalg.inv(T @ exp_se3(xi)) @ self.T_visual)

        return np.column_stack(
            [(residual(step * e) - residual(-step * e)) / (2 * step) for e in np.eye(6)]
        )

    def cost(self, T):
        total = 0.0
        for r, _, w, log_theta in self.terms(T):
            e = (w * r**2).sum()
            theta = None if log_theta is None else np.exp(log_theta)
            total += e / 2 if theta is None else (theta - theta * np.exp(-e / theta)) / 2
        return total

    def normal_equations(self, T):
        H, b = np.zeros((6, 6)), np.zeros(6)
        for r, J, w, log_theta in self.terms(T):
            e = (w * r**2).sum()
            robust = 1.0 if log_theta is None else np.exp(-e / np.exp(log_theta))
            H += robust * J.T @ (w[:, None] * J)
            b -= robust * J.T @ (w * r)
        return H, b

    def fixed_damping(self, T, iterations, damping):
        for _ in range(iterations):
            H, b = self.normal_equations(T)
            T = T @ exp_se3(np.linalg.solve(H + damping * np.eye(6), b))
        return T
