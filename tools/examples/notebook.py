# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# A notebook in percent format: open it in VS Code, Spyder or Jupyter (jupytext), or run it with python3.

# %% [markdown]
# # A race in Python
# Simulates a race, runs both presets on it and draws three figures: the race on the map, the errors over time, and one
# frame from above with the range image of its front sensor.

# %%
import matplotlib.pyplot as plt
import numpy as np

import overtake

race = overtake.simulate("overtake", seed=7, seconds=8)
track = overtake.load_map(race.path)
truth = race.truth
others = ~truth["is_ego"]
print(race)

# %% [markdown]
# ## Two presets
# `overtake.run` gives one frame after the other. Their detections and tracks are copies, so that they may be kept.

# %%
runs = {preset: list(overtake.run(race, preset=preset)) for preset in ("best", "paper")}
colours = {"best": "tab:blue", "paper": "tab:orange"}


def confirmed(frame):
    """The confirmed tracks of a frame, one row each."""
    tracks = frame.tracks.to_pandas()
    return tracks[tracks["state"] == overtake.TrackState.CONFIRMED]


# %% [markdown]
# ## Figure 1: the race on the map

# %%
figure, axes = plt.subplots(figsize=(10, 5))
normal = np.column_stack([-np.gradient(track.y_m), np.gradient(track.x_m)])
normal /= np.linalg.norm(normal, axis=1)[:, None]
for side, width in ((1, track.width_left_m), (-1, track.width_right_m)):
    axes.plot(track.x_m + side * width * normal[:, 0], track.y_m + side * width * normal[:, 1], color="0.6", lw=1)
own = truth["is_ego"]
axes.plot(truth["x_m"][own], truth["y_m"][own], color="k", lw=1, ls="--", label="own car")
for preset, frames in runs.items():
    rows = [(x, y) for frame in frames for x, y in zip(confirmed(frame)["x_m"], confirmed(frame)["y_m"])]
    x_m, y_m = np.array(rows).T
    axes.plot(x_m, y_m, ".", ms=4 if preset == "best" else 7, color=colours[preset],
              zorder=3 if preset == "best" else 2, label=f"confirmed tracks, {preset}")
for name in np.unique(truth["name"][others]):
    rows = truth["name"] == name
    axes.plot(truth["x_m"][rows], truth["y_m"][rows], color="tab:green", lw=9, alpha=0.5, zorder=2.5,
              label=f"{name}, truth")
axes.set(aspect="equal", xlabel="east (m)", ylabel="north (m)", title="The race on the map")
margin = 40
axes.set_xlim(truth["x_m"].min() - margin, truth["x_m"].max() + margin)
axes.set_ylim(truth["y_m"].min() - margin, truth["y_m"].max() + margin)
axes.legend(loc="best")
plt.show()

# %% [markdown]
# ## Figure 2: errors over time
# For each car of the truth, the nearest confirmed track within 5 m.

# %%
figure, (error_axes, speed_axes, count_axes) = plt.subplots(3, 1, figsize=(10, 8), sharex=True)
for preset, frames in runs.items():
    times, errors, speeds, counts = [], [], [], []
    for frame in frames:
        tracks = confirmed(frame)
        counts.append(len(tracks))
        cars = np.flatnonzero(others & (truth["frame"] == frame.number))
        best_error, best_speed = np.nan, np.nan
        if len(tracks) and len(cars):
            distances = np.hypot(truth["x_m"][cars][:, None] - tracks["x_m"].to_numpy(),
                                 truth["y_m"][cars][:, None] - tracks["y_m"].to_numpy())
            car, row = np.unravel_index(distances.argmin(), distances.shape)
            if distances[car, row] < 5:
                best_error = distances[car, row]
                best_speed = tracks["speed_mps"].to_numpy()[row] - truth["speed_mps"][cars[car]]
        times.append((frame.stamp_ns - runs["best"][0].stamp_ns) * 1e-9)
        errors.append(best_error)
        speeds.append(best_speed)
    error_axes.plot(times, errors, color=colours[preset], label=preset)
    speed_axes.plot(times, speeds, color=colours[preset], label=preset)
    count_axes.step(times, counts, color=colours[preset], where="post", label=preset)
error_axes.set(ylabel="position error (m)", title="Nearest confirmed track", ylim=(0, None))
speed_axes.set(ylabel="speed error (m/s)")
count_axes.set(ylabel="confirmed tracks", xlabel="time (s)", ylim=(0, 12))
count_axes.axhline(len(np.unique(truth["name"][others])), color="tab:green", lw=1, label="cars of the truth")
for axes in (error_axes, speed_axes, count_axes):
    axes.grid(alpha=0.3)
    axes.legend(loc="upper right", ncols=3)
plt.show()

# %% [markdown]
# ## Figure 3: one frame
# The frame with the most points on cars, again with copies of its labels and images. Points are in the vehicle frame by
# the mounting of their sensor; detections with their covariance (95 %).

# %%
number = max(runs["best"], key=lambda frame: frame.detections.point_count.sum()).number
for frame in overtake.run(race, copy_labels=True, copy_images=True):
    if frame.number == number:
        break
rig = overtake.load_rig(race.path)
figure, (above, image_axes) = plt.subplots(2, 1, figsize=(10, 8), height_ratios=[2, 1])
for sensor in rig.sensors:
    labels = frame.labels(sensor.name)
    cos, sin = np.cos(sensor.yaw_rad), np.sin(sensor.yaw_rad)
    x_m = sensor.x_m + cos * labels.x_m - sin * labels.y_m
    y_m = sensor.y_m + sin * labels.x_m + cos * labels.y_m
    above.plot(x_m[labels.label <= 0], y_m[labels.label <= 0], ",", color="0.7")
    above.plot(x_m[labels.label > 0], y_m[labels.label > 0], ".", ms=2, color="tab:purple")
found = frame.detections
for i in range(len(found)):
    spread = np.array([[found.var_x[i], found.cov_xy[i]], [found.cov_xy[i], found.var_y[i]]])
    circle = np.array([np.cos(np.linspace(0, 2 * np.pi, 60)), np.sin(np.linspace(0, 2 * np.pi, 60))])
    ellipse = np.linalg.cholesky(5.99 * spread) @ circle
    above.plot(found.x_m[i] + ellipse[0], found.y_m[i] + ellipse[1], color="tab:red", lw=1)
    along = np.array([np.cos(found.heading_rad[i]), np.sin(found.heading_rad[i])])
    across = np.array([-along[1], along[0]])
    corners = [found.x_m[i], found.y_m[i]] + np.outer([2.46, 2.46, -2.46, -2.46, 2.46], along) + np.outer(
        [0.94, -0.94, -0.94, 0.94, 0.94], across)
    above.plot(corners[:, 0], corners[:, 1], color="tab:red")
above.plot(0, 0, "k^", label="own car")
above.set(aspect="equal", xlim=(-30, 100), ylim=(-25, 25), xlabel="ahead (m)", ylabel="left (m)",
          title=f"Frame {frame.number}: points, clusters (purple) and detections (red)")
above.legend(loc="upper left")
ranges = np.ma.masked_equal(frame.image("range", "front"), 0)
shown = image_axes.imshow(ranges, aspect="auto", cmap="viridis_r", interpolation="nearest", vmax=120)
image_axes.set(title="Range image of the front sensor", xlabel="column", ylabel="row")
figure.colorbar(shown, ax=image_axes, label="range (m)")
figure.tight_layout()
plt.show()
