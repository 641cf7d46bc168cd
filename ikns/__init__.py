"""Intrinsic kinematic null space: learned from a person, driving a wearable robot.

Public names, in the order of the data flow. They load on first use, so importing the
package takes next to no time.

Recording: markers over time
    read                         read a file of markers: C3D, TRC, CSV, TSV or XDF
    write                        write a recording as C3D, TRC or CSV
    write_c3d                    write a recording as C3D
    Recording                    time, markers and labels; NaN where not seen

Skeleton: the body of a person, or a robot
    Skeleton                     the upper body, scaled to a person
    MarkerSet                    which label sits on which segment
    scale                        fit a skeleton to a static trial
    fit_lengths                  the same with an exploration, by optimization
    Chain                        joints of a task, and the links that perform it
    load_chain                   a chain by its name or from a file
    extrinsic_chain              joints that a task does not use, to be read as well
    Robot                        any robot arm from its URDF

Motion: joints over time
    MarkerIK                     inverse kinematics: markers in, a motion out
    Motion                       joint angles, velocities and hand poses

Map: the null space and its range where the hand is
    check_recordings             find problems of recordings before they are used
    calibrate                    static trial and explorations in, a subject out
    rewear                       a subject whose markers were reapplied
    method_summary               change of c of each method without intent
    Subject                      skeleton, map and report of a person
    NullSpaceMap                 the map, learned from still samples
    null_space_samples           the still samples of a motion
    analytic_map                 the same map from the Jacobian
    NaturalNeighborInterpolator  the interpolation between its points
    IntentMap                    c of intent: elbow swivel minus natural posture
    NaturalPosture               elbow posture expected without intent
    hinge_swivel                 how far an arm is turned from shoulder to wrist

Control: from live markers to the control signal c
    open_source                  connect to live markers, or replay a file
    FrameSolver                  joint angles and c of one frame
    run                          the control loop, from a source to a finger
    read_run                     read a recorded run
    replay_run                   recompute a recorded run, bit for bit
    warm_up                      compile before the first frame

Finger: the wearable robotic finger
    open_finger                  connect to a finger by its address
    open_fingers                 several, each with its degree of freedom of the map
    SimulatedFinger              a finger without hardware
    DynamixelFinger              a finger with a Dynamixel servo
    check_finger                 conformance test of a finger class

Analysis: learned against analytic, and uncontrolled manifold
    compare                      two maps on a motion
    compare_motion               a map with the null spaces of an arm
    compare_samples              the same on plain arrays
    variance_split               joint variance inside and outside a null space
    across_trials                that split over repetitions
    within_trial                 that split over the samples of one trial
    surrogate_test               whether the split is more than chance
    available_range              range of a direction with the hand held
    available_control            range of c with the hand held

Simulation: virtual subjects with a known truth
    virtual_subject              draw a person
    simulate_protocol            their calibration trials
    write_protocol               these trials as C3D files, with the truth

Errors
    IknsError                    root of all errors that the package raises on purpose

Experiments with people are in :mod:`ikns.experiments`, figures and reports in
:mod:`ikns.view`, the command line in :mod:`ikns.cli`.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
