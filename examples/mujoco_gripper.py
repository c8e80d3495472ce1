"""A MuJoCo gripper picks a soft cube up from a table by friction, and holds it for five seconds.

    pip install mujoco, and palpate's wheel (docs/python.md#install)
    python examples/mujoco_gripper.py

Two fingers of 50 g on position actuators close to a grip of 4 N and lift the cube, 216 g, by 10 cm. Prints the forces of the left finger beside its
actuator's, and the height.
"""

import mujoco
import palpate
from palpate.mujoco import SoftBody

MODEL = """
<mujoco model="gripper">
  <option timestep="0.002" integrator="implicitfast"/>
  <visual><global offwidth="960" offheight="720"/></visual>
  <worldbody>
    <light pos="0.3 -0.5 1" dir="-0.3 0.5 -1"/>
    <geom name="table" type="plane" size="0.3 0.3 0.01" friction="0.8" rgba="0.7 0.7 0.7 1"/>
    <body name="hand" pos="0 0 0.16">
      <joint name="lift" type="slide" axis="0 0 1" damping="20"/>
      <geom name="palm" type="box" size="0.08 0.02 0.015" mass="0.5" contype="0" conaffinity="0" rgba="0.3 0.3 0.3 1"/>
      <body name="left" pos="-0.06 0 -0.12">
        <joint name="left" type="slide" axis="1 0 0" damping="2"/>
        <geom name="left_pad" type="box" size="0.006 0.02 0.025" mass="0.05" friction="0.8" rgba="0.2 0.4 0.7 1"/>
      </body>
      <body name="right" pos="0.06 0 -0.12">
        <joint name="right" type="slide" axis="-1 0 0" damping="2"/>
        <geom name="right_pad" type="box" size="0.006 0.02 0.025" mass="0.05" friction="0.8" rgba="0.2 0.4 0.7 1"/>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="left" body2="right"/></contact>
  <actuator>
    <position name="lift" joint="lift" kp="2000" kv="100"/>
    <position name="left" joint="left" kp="400" forcerange="-4 4"/>
    <position name="right" joint="right" kp="400" forcerange="-4 4"/>
  </actuator>
  <sensor><user name="grip" objtype="body" objname="left" dim="3"/></sensor>
</mujoco>
"""


def make(cells=4, timestep=None, finger_mass=None, **options):
    """Model, data and soft cube; options of SoftBody."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    if timestep is not None:
        model.opt.timestep = timestep
    for finger in ("left", "right"):
        if finger_mass is not None:
            body = model.body(finger).id
            model.body_inertia[body] *= finger_mass / model.body_mass[body]
            model.body_mass[body] = finger_mass
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    cube = palpate.record(f"box:0.06x0.06x0.06/{cells}x{cells}x{cells}", young=2e4, poisson=0.4, density=1000, damping_ratio=0.1, modes=60, order=1)
    soft = SoftBody(model, data, palpate.Object("cube", cube, position=[0, 0, 0.03]), sensors=["grip"], **options)
    return model, data, soft


def command(data):
    """Targets of the actuators: close from 0.2 s, lift from 1 s to 2 s."""
    data.ctrl[1:] = 0 if data.time < 0.2 else 0.1  # m; the grip is at the limit of force then
    data.ctrl[0] = 0.1 * min(max(data.time - 1, 0), 1)


def main():
    model, data, soft = make()
    print("  time  grip (MuJoCo's actuator)  lifted by friction  height of the cube  trials")
    while data.time < 7:
        command(data)
        soft.step()
        if round(data.time / model.opt.timestep) % 250 == 0:
            grip, actuator = data.sensor("grip").data, data.actuator("left").force[0]
            lifted = -(soft.force("left") + soft.force("right"))[2]
            height = soft.simulation.poses[0, 2] - 0.03
            print(f"{data.time:5.1f} s  {-grip[0]:6.3f} N  ({actuator:6.3f} N)     {lifted:8.4f} N          {1000 * height:8.3f} mm  {soft.coupling.trials}")
    print(f"energy made by the coupling: {soft.energy_error:.2e} J of {soft.work_on_soft:.2e} J")


if __name__ == "__main__":
    main()
