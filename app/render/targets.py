"""Giving framebuffers back safely."""

from __future__ import annotations

from app.gpu import Framebuffer, Gpu


def release_targets(gpu: Gpu, *targets: Framebuffer) -> None:
    """Release framebuffers of which one may be bound: moderngl binds that again after the next clear."""
    gpu.ctx.detect_framebuffer(0).use()
    for target in targets:
        target.release()
