# SPDX-License-Identifier: MIT
"""A quadrotor that flies between random waypoints; its autopilot answers every fault."""
import math

from common import Physical, Vehicle, clip, wrap

G = 9.81


class Quadrotor(Vehicle):
    DT, ROWS = .1, 1500
    COLUMNS = ("t_s", "u.throttle", "u.pitch_rad", "u.yawrate_radps", "s.x_m", "s.y_m", "s.height_m",
               "s.climb_mps", "s.speed_mps", "s.pitch_rad", "s.heading_rad", "s.yawrate_radps",
               "s.rotor_rpm", "s.current_A", "s.battery_V")
    SIGMA = dict(x=.1, y=.1, height=.08, climb=.05, speed=.05, pitch=.006, heading=.01, yawrate=.02,
                 rotor=20., current=.25, battery=.02)
    ANGLES = ("heading",)
    FOLLOW = ("x", "y", "height", "heading", "charge")
    SENSOR_FAULTS = ("bias:current", "bias:speed", "drift:current", "gain:speed", "noise:pitch",
                     "stuck:climb")
    PHYSICAL = {
        "loss": Physical("thrust", .015, {"climb": -1}),
        "friction": Physical("friction", .08, {"current": 1}, ramp=True),
        "thin": Physical("thrust", .015, {"climb": -1}, ("s.height_m",), since=False,
                         draw=lambda r: r.uniform(4, 9),
                         where=lambda f, low: low < f["height"] < low + 6),
        "wind": Physical("drag", .048, {"speed": -1}, ("s.x_m", "s.y_m"), since=False,
                         draw=lambda r: (r.uniform(10, 25), r.uniform(10, 25)),
                         where=lambda f, low: low[0] < f["x"] < low[0] + 22 and low[1] < f["y"] < low[1] + 22),
        "loss_left": Physical("yaw", .15, {"yawrate": -1, "heading": 0}, ("s.yawrate_radps", "u.yawrate_radps"),
                              since=False, where=lambda f, _: f["yawrate"] > .1),
    }

    def __init__(self, r):
        super().__init__(r)
        self.x, self.y, self.height = r.uniform(5, 55), r.uniform(5, 55), r.uniform(4, 16)
        self.heading, self.charge = r.uniform(-3, 3), 1 + r.gauss(0, .004)
        self.climb = self.speed = self.pitch = self.yawrate = self.gust = self.lift = 0.0
        self.rpm = 5000.0
        self.current, self.battery = 16.0, 15.6
        self.trim = .78
        self.mass, self.motor = self.jitter(1, .002), self.jitter(1, .004)
        self.goal, self.hold = (self.x, self.y, self.height), r.uniform(5, 8)

    def nominal(self):
        self.mass = self.motor = 1.0

    def aim(self):
        r = self.r
        self.goal = (r.uniform(5, 55), r.uniform(5, 55), r.uniform(4, 16))

    def command(self, t):
        dx, dy = self.goal[0] - self.x, self.goal[1] - self.y
        far, away = math.hypot(dx, dy), wrap(math.atan2(dy, dx) - self.heading)
        away = away if far > 1 else 0.0
        if far < 2 and t > self.hold:
            self.aim()
        climb = clip(.5 * (self.goal[2] - self.height), -1.2, 1.2)
        speed = clip(.5 * far, 0, 4) * max(0, math.cos(away)) ** 2
        error = climb - self.climb
        self.trim = clip(self.trim + .01 * error * self.DT, .6, .95)
        throttle = clip(self.trim + .06 * error, .4, 1)
        pitch = clip(.035 * speed + .06 * (speed - self.speed), -.3, .3)
        return throttle, pitch, clip(.9 * away, -.8, .8)

    def step(self, u, fault):
        dt = self.DT
        wanted = 6400 * u[0] * (self.battery / 15.6)
        self.rpm += dt / .2 * (wanted - self.rpm)
        self.pitch += dt / .3 * (u[1] - self.pitch)
        push = G * (self.rpm / 5000) ** 2 * (1 - fault("thrust")) / self.mass
        self.gust = self.wander(self.gust, 3, .008)
        self.lift = self.wander(self.lift, 3, .008)
        drag = .35 + fault("drag")
        self.climb += dt * (push * math.cos(self.pitch) - G - .5 * self.climb + self.lift)
        self.speed += dt * (push * math.sin(self.pitch) - drag * self.speed + self.gust)
        self.yawrate += dt / .3 * (u[2] * (1 - fault("yaw")) - self.yawrate)
        self.heading = wrap(self.heading + dt * self.yawrate)
        self.x += dt * self.speed * math.cos(self.heading)
        self.y += dt * self.speed * math.sin(self.heading)
        self.height += dt * self.climb
        self.current = 2 + 14 * (self.rpm / 5000) ** 3 * self.motor * (1 + fault("friction"))
        self.charge -= dt * self.current / 18000
        self.battery = 13.2 + 2.6 * self.charge - .012 * self.current

    def outputs(self):
        return (self.x, self.y, self.height, self.climb, self.speed, self.pitch, self.heading,
                self.yawrate, self.rpm, self.current, self.battery)
