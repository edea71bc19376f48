"""A job's status as one line, for Blender's status line and the terminal."""


def progress_of(status):
    """0 to 1, by what the job will stop at first as far as its farm knows."""
    if status is None:
        return 0.0
    if status.eta_seconds >= 0 and status.wall_seconds > 0:
        return status.wall_seconds / (status.wall_seconds + status.eta_seconds)
    return min(1.0, status.progress)


def text_of(rendering):
    """Samples, the estimated error with its 95 % interval, the remaining time; or what is being done or waited for."""
    status = rendering.status
    if status is None or not status.spp:
        waiting = status is not None and status.state.value in ("queued", "paused")
        return rendering.note or (f"job {rendering.job_id} is {status.state.value}" if waiting else "rendering")
    parts = [f"{status.spp:.4g} samples"]
    if status.relmse is not None:
        text = f"error {status.relmse:.2g}"
        if status.relmse_low is not None and status.relmse_high is not None:
            text += f" ({status.relmse_low:.2g} to {status.relmse_high:.2g})"
        parts.append(text)
    if status.eta_seconds >= 0 and not status.state.final:
        parts.append(f"{_time(status.eta_seconds)} left")
    if rendering.note:
        parts.append(rendering.note)
    return ", ".join(parts)


def _time(seconds):
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    minutes, seconds = divmod(seconds, 60)
    return f"{minutes}:{seconds:02} min" if minutes < 60 else f"{minutes // 60}:{minutes % 60:02} h"
