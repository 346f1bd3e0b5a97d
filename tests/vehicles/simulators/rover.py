# SPDX-License-Identifier: MIT
"""rover: a four-wheeled rover with front steering in MuJoCo drives between random waypoints.

The yard is hilly (a height field) and the same in every run. The commands are the voltages of the
front and the rear drive and the steering angle.
"""
import math

import mujoco
import numpy as np
from base import Machine, Physical, clip, jitter, wrap

XML = """
<mujoco model="rover">
  <option timestep="0.004" integrator="implicitfast" cone="elliptic" impratio="5"/>
  <asset><hfield name="yard" nrow="101" ncol="101" size="15 15 1.2 .2"/></asset>
  <default>
    <default class="wheel">
      <geom type="ellipsoid" size=".13 .13 .06" density="900" friction=".9 .01 .002" condim="4"
            contype="2" conaffinity="1" solref=".02 1"/>
    </default>
  </default>
  <worldbody>
    <geom name="ground" type="hfield" hfield="yard" contype="1" conaffinity="2"/>
    <body name="hull" pos="0 0 2">
      <freejoint/>
      <geom type="box" size=".36 .2 .07" mass="26" contype="0" conaffinity="0"/>
      <geom type="box" size=".1 .1 .1" pos="0 0 .15" mass="4" contype="0" conaffinity="0"/>
      <site name="imu"/>
      %s
    </body>
  </worldbody>
  <actuator>
    <position name="sfl" joint="steer_fl" kp="60" kv="6"/>
    <position name="sfr" joint="steer_fr" kp="60" kv="6"/>
    <motor name="mfl" joint="roll_fl"/><motor name="mfr" joint="roll_fr"/>
    <motor name="mrl" joint="roll_rl"/><motor name="mrr" joint="roll_rr"/>
  </actuator>
  <sensor><velocimeter site="imu"/><gyro site="imu"/></sensor>
</mujoco>
"""
WHEEL = """
<body name="{n}" pos="{x} {y} -.06">{steer}
  <inertial pos="0 0 0" mass=".4" diaginertia=".002 .002 .002"/>
  <body name="w{n}">
    <joint name="roll_{n}" axis="0 1 0" damping=".05" armature=".03"/>
    <geom class="wheel" name="g{n}" euler="90 0 0"/>
  </body>
</body>"""
STEER = '<joint name="steer_{n}" axis="0 0 1" armature=".02" damping=".5" range="-35 35"/>'
WHEELS = ("fl", "fr", "rl", "rr")
PLACES = ((.3, .27), (.3, -.27), (-.3, .27), (-.3, -.27))    # m from the middle: ahead, left
TORQUE, OHM = 2.4, 2.2       # V s/rad and Nm per A of a wheel's motor, Ohm
BASE, TRACK = .6, .54        # m between the axles, between left and right


def text():
    """The rover as MuJoCo reads it."""
    return XML % "".join(
        WHEEL.format(n=name, x=x, y=y, steer=STEER.format(n=name) if name[0] == "f" else "")
        for name, (x, y) in zip(WHEELS, PLACES))


def height(x, y):
    """The yard, in m."""
    return (.30 * np.sin(.38 * x + .1 * y + .4) + .25 * np.sin(.1 * x - .42 * y)
            + .12 * np.cos(.55 * x + .5 * y) + .6)


def attitude(q):
    """(heading, pitch with the nose up, roll) of a unit quaternion, in rad."""
    w, x, y, z = q
    return (math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
            -math.asin(clip(2 * (w * y - z * x), -1, 1)),
            math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)))


class Rover(Machine):
    """The rover for 200 s.

    Strengths: bearing, sand: Nm of drag more at a wheel; linkage: rad of steering off; lefts: share
    of the steering angle lost; uphill, hot: share of the motors' torque per ampere lost.
    """
    RATE, LENGTH = .1, 2000
    CONTROL, STEPS = 5, 5      # turns of the motors a row, steps of 4 ms a turn
    COLUMNS = ["t_s", "u.front_V", "u.rear_V", "u.steer_rad", "s.x_m", "s.y_m", "s.heading_rad",
               "s.pitch_rad", "s.roll_rad", "s.speed_mps", "s.yawrate_radps", "s.frontrate_radps",
               "s.rearrate_radps", "s.frontcurrent_A", "s.rearcurrent_A", "s.motor_degC",
               "s.battery_V"]
    SIGMA = dict(x=.04, y=.04, heading=.01, pitch=.006, roll=.006, speed=.015, yawrate=.012,
                 frontrate=.06, rearrate=.06, frontcurrent=.12, rearcurrent=.12, motor=.5,
                 battery=.03)
    ANGLES = ("heading",)
    TAUS, LAG, NOT_SCANNED, TRIG = (.3, 2, 30), 2., ("x", "y"), True
    HEALTHY = (26, 19)
    PARTNER = dict(rearcurrent=("rearrate", "frontrate"), frontcurrent=("rearrate", "frontrate"),
                   rearrate=("rearcurrent", "frontcurrent"),
                   frontrate=("rearcurrent", "frontcurrent"))
    PHYSICAL = {
        "bearing": Physical(.6, .8, dict(rearcurrent=1, rearrate=-1, speed=-1, frontcurrent=1,
                                         motor=1)),
        "linkage": Physical(.022, .030, dict(yawrate=1)),
        "sand": Physical(.5, .7, dict(frontcurrent=1, rearcurrent=1, speed=-1),
                         ("s.x_m", "s.y_m"), False),
        "lefts": Physical(.10, .14, dict(yawrate=-1), ("u.steer_rad", "s.yawrate_radps"), False),
        "uphill": Physical(.022, .030, dict(frontcurrent=1, frontrate=0),
                           ("s.pitch_rad", "s.frontcurrent_A"), False),
        "hot": Physical(.022, .030, dict(rearcurrent=1, rearrate=0), ("s.motor_degC",), False),
    }
    FAULTS = ("bias:yawrate", "drift:rearcurrent", "gain:speed", "bearing", "linkage", "sand",
              "lefts", "uphill", "hot")

    def __init__(self, r):
        self.mass, self.grip = jitter(r, 1, .01), jitter(r, 1, .02)
        self.torque = np.repeat([jitter(r, TORQUE), jitter(r, TORQUE)], 2)
        self.ohms = np.repeat([jitter(r, OHM, .01), jitter(r, OHM, .01)], 2)
        drag = [jitter(r, .35, .02), jitter(r, .35, .02)]
        self.drag = np.repeat(drag, 2) * jitter(r, 1, .03)     # Nm at each wheel
        self.link = r.gauss(0, .002)
        self.cooling, self.air = jitter(r, 1, .02), r.uniform(14, 22)
        self.temperature, self.charge = self.air + r.uniform(2, 20), r.uniform(.6, 1.)
        self.start = r.uniform(-9, 9), r.uniform(-9, 9), r.uniform(-3, 3)    # m, m, rad
        self.waypoints = [(r.uniform(-11, 11), r.uniform(-11, 11), r.uniform(.6, 1.1))
                          for _ in range(80)]                                # m, m, m/s
        self.noise = np.random.default_rng(r.randrange(1 << 30))
        self.leg, self.summed, self.rough, self.amps = 0, 0., 0., np.zeros(4)
        self.front = self.rear = self.steer = 0.

    def built(self):
        """The rover with this run's dispersions, dropped on the yard: its model and data."""
        model = mujoco.MjModel.from_xml_string(text())
        grid = np.linspace(-15, 15, 101)
        model.hfield_data[:] = np.clip(height(*np.meshgrid(grid, grid)) / 1.2, 0, 1).ravel()
        model.body_mass[model.body("hull").id] *= self.mass
        for name in WHEELS:
            model.geom_friction[model.geom("g" + name).id, 0] *= self.grip
        data = mujoco.MjData(model)
        x, y, heading = self.start
        data.qpos[:3] = x, y, float(height(x, y)) + .35
        data.qpos[3:7] = math.cos(heading / 2), 0, 0, math.sin(heading / 2)
        for _ in range(500):       # it lands, and rolls where the yard slopes
            mujoco.mj_step(model, data)
        self.wheels = [model.joint("roll_" + name).dofadr[0] for name in WHEELS]
        return model, data

    def drive(self, t, data, heading, first):
        """The driver: goes on to the next waypoint, and once a row (first) sets the commands."""
        x, y = data.qpos[:2]
        to_x, to_y, fast = self.waypoints[self.leg % 80]
        away = math.hypot(to_x - x, to_y - y)
        off = wrap(math.atan2(to_y - y, to_x - x) - heading)
        if away < .8 or (away < 2.5 and abs(off) > 1.4):
            self.leg += 1
        if t < 3:
            self.front = self.rear = self.steer = 0.
        elif first:
            self.steer += clip(clip(.7 * off, -.4, .4) - self.steer, -.08, .08)
            slower = fast * (1 - .4 * abs(self.steer) / .4) - data.sensordata[0]
            self.summed = clip(self.summed + .02 * slower, -4, 4)
            volts = clip(fast / .13 * TORQUE * .95 + self.summed + 7 * slower, 0, 36)
            self.front += clip(volts - self.front, -3, 3)
            self.rear += clip(.92 * volts - self.rear, -3, 3)

    def damage(self, data, fault, strength, edges, begun, pitch):
        """Whether the fault acts, the drag in Nm and the share of torque left at each wheel, and
        the angle in rad to which the commands steer."""
        drag, left, angle = self.drag.copy(), np.ones(4), self.steer + self.link
        inside = bool(fault) and begun
        if fault == "bearing":
            drag[2:] += strength * inside
        elif fault == "linkage":
            angle += strength * inside
        elif fault == "sand":
            x, y = -8 + 6 * edges[0], -8 + 6 * edges[1]
            inside = inside and x < data.qpos[0] < x + (8 + 2 * edges[2]) \
                and y < data.qpos[1] < y + (8 + 2 * edges[3])
            drag += strength * inside
        elif fault == "lefts":
            inside = inside and self.steer > .06 + .04 * edges[0]
            angle -= strength * self.steer * inside
        elif fault == "uphill":    # front magnets saturate: less torque for the current
            inside = inside and pitch > .03 + .02 * edges[1] and self.amps[:2].sum() > 1.
            left[:2] -= strength * inside
        elif fault == "hot":
            inside = inside and self.temperature > 37 + 4 * edges[2]
            left[2:] -= strength * inside
        return bool(inside), drag, left, angle

    def turn(self, model, data, drag, left, angle):
        """The wheels, the motors' heat and the battery until the next turn."""
        ahead = BASE / math.tan(angle) if abs(angle) > 1e-4 else 1e6     # Ackermann's centre, in m
        data.ctrl[0] = math.atan(BASE / (ahead - TRACK / 2))
        data.ctrl[1] = math.atan(BASE / (ahead + TRACK / 2))
        self.rough += -.02 * self.rough + self.noise.normal(0, .008)
        load, torque = drag * (1 + self.rough), self.torque * left
        volts = np.array([self.front, self.front, self.rear, self.rear])
        for _ in range(self.STEPS):
            rates = data.qvel[self.wheels]
            self.amps = (volts - torque * rates) / self.ohms
            data.ctrl[2:] = torque * self.amps - load * np.tanh(10 * rates)
            mujoco.mj_step(model, data)
        heat = self.ohms[2] * (self.amps[2] ** 2 + self.amps[3] ** 2) + 1
        cooled = .15 * self.cooling * (self.temperature - self.air)
        self.temperature += self.RATE / self.CONTROL * (heat - cooled) / 12
        self.charge -= self.RATE / self.CONTROL * (1 + abs(self.amps).sum()) / 3600 / 12

    def rows(self, fault, strength, edges, onset):
        model, data = self.built()
        out, acts = [], []
        for k in range(self.LENGTH):
            t = k * self.RATE
            for j in range(self.CONTROL):
                heading, pitch, roll = attitude(data.qpos[3:7])
                self.drive(t, data, heading, j == 0)
                act, *effect = self.damage(data, fault, strength, edges, t >= onset, pitch)
                self.turn(model, data, *effect)
            rates, amps = data.qvel[self.wheels], self.amps
            total = 1 + amps.sum() * .8
            out.append((self.front, self.rear, self.steer, data.qpos[0], data.qpos[1], heading,
                        pitch, roll, data.sensordata[0], data.sensordata[5],
                        (rates[0] + rates[1]) / 2, (rates[2] + rates[3]) / 2, amps[0] + amps[1],
                        amps[2] + amps[3], self.temperature, 34 + 4 * self.charge - .06 * total))
            acts.append(act)
        return out, acts
