"""A MuJoCo finger presses a liver to 1 N, by force control with palpate's contact force as its sensor.

    pip install mujoco, and palpate's wheel (docs/python.md#install)
    python examples/mujoco_press.py

The liver is an ellipsoid that is thin on one side, 16 cm long, on a table. The finger is a ball of 20 mm radius on 100 g, as a thumb.
"""

import os
import tempfile

import mujoco
import numpy as np
import palpate
from palpate.mujoco import SoftBody

MODEL = """
<mujoco model="press">
  <option timestep="0.002" integrator="implicitfast"/>
  <visual><global offwidth="960" offheight="720"/></visual>
  <worldbody>
    <light pos="0.3 -0.5 1" dir="-0.3 0.5 -1"/>
    <geom name="table" type="plane" size="0.3 0.3 0.01" friction="0.6" rgba="0.7 0.7 0.7 1"/>
    <body name="finger" pos="-0.015 0 0.09">
      <joint name="down" type="slide" axis="0 0 -1" damping="5"/>
      <geom name="tip" type="sphere" size="0.02" mass="0.1" friction="0.6" rgba="0.2 0.4 0.7 1"/>
      <geom name="shaft" type="cylinder" fromto="0 0 0 0 0 0.1" size="0.015" mass="0" contype="0" conaffinity="0" rgba="0.2 0.4 0.7 1"/>
    </body>
  </worldbody>
  <actuator><motor name="down" joint="down" ctrlrange="-5 5"/></actuator>
  <sensor><user name="touch" objtype="body" objname="finger" dim="3"/></sensor>
</mujoco>
"""


def liver(modes=40, cell_size=0.016):
    """Recording of a body like a liver: broad and thick on one side, thin on the other."""
    rows, columns = 12, 24
    polar, around = np.meshgrid(np.pi * np.arange(1, rows) / rows, 2 * np.pi * np.arange(columns) / columns, indexing="ij")
    ring = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1).reshape(-1, 3)
    x, y, z = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]]).T
    thickness = 0.03 - 0.01 * x - 0.005 * y**2
    nodes = np.stack([0.08 * x, 0.05 * y * (1 - 0.25 * x), z * thickness], axis=1)
    at = np.arange((rows - 1) * columns).reshape(rows - 1, columns)
    a, b = at[:-1], at[1:]
    next_a, next_b = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    top, bottom = np.full(columns, at.size), np.full(columns, at.size + 1)
    faces = [(a, b, next_b), (a, next_b, next_a), (top, at[0], np.roll(at[0], -1)), (bottom, np.roll(at[-1], -1), at[-1])]
    triangles = np.concatenate([np.stack([corner.ravel() for corner in face], axis=1) for face in faces])
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "liver.obj")
        with open(path, "w") as file:
            file.writelines(f"v {x} {y} {z}\n" for x, y, z in nodes)
            file.writelines(f"f {a} {b} {c}\n" for a, b, c in triangles + 1)
        return palpate.record(path, cell_size=cell_size, material="liver", damping_ratio=0.1, modes=modes)


def make(recording=None, timestep=None, **options):
    """Model, data and soft liver on the table; options of SoftBody."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    if timestep is not None:
        model.opt.timestep = timestep
    data = mujoco.MjData(model)
    recording = recording or liver()
    low = recording.positions[:, 2].min()
    soft = SoftBody(model, data, palpate.Object("liver", recording, position=[0, 0, -low]), sensors=["touch"], **{"max_contact_samples": 24, **options})
    return model, data, soft


class ForceControl:
    """Integral force control: the wanted force, and an integral of what is missing; the finger's weight is held.

    Parameters
    ----------
    wanted : float
        Force [N].
    gain : float
        Of the integral [1/s].
    """

    def __init__(self, model, wanted=1.0, gain=5.0):
        self.wanted, self.gain = wanted, gain
        self.weight = model.body("finger").mass[0] * 9.81
        self.integral = 0.0

    def command(self, measured, step):
        """Force of the motor [N]."""
        self.integral += self.gain * (self.wanted - measured) * step
        self.integral = min(max(self.integral, -1.0), 1.0)
        return 0.8 * self.wanted + self.integral - self.weight


def main():
    model, data, soft = make()
    control = ForceControl(model)
    print("  time  measured  contact points  indentation of the tip")
    first = None
    while data.time < 5:
        measured = data.sensor("touch").data[2]
        data.ctrl[0] = control.command(measured, model.opt.timestep)
        soft.step()
        measured = data.sensor("touch").data[2]
        first = data.qpos[0] if first is None and measured > 0 else first
        if round(data.time / model.opt.timestep) % 250 == 0:
            contacts = (soft.contacts["geom"] == model.geom("tip").id).sum()
            depth = 0 if first is None else data.qpos[0] - first
            print(f"{data.time:5.1f} s  {measured:.4f} N  {contacts:6}          {1000 * depth:6.2f} mm")
    print(f"{measured:.4f} N of 1 N: off by {100 * abs(measured - 1):.2f} %")


if __name__ == "__main__":
    main()
