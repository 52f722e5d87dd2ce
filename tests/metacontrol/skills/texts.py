"""Texts in the language of skills, and what the checks find in them."""

from __future__ import annotations

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Diagnostic, Severity
from regraft.adaptation_manager.planners.metacontrol.skills.reading import CheckedSkills, checked_text

SKILL_OF_THE_PAPER = """\
Skill to_navigate {
  quality attributes [safety, performance, energy]
  input{DistanceToWall: float}
  result{
    success: "OK",
    error: "InternalError",
    inprogress: "IN_PROGRESS"
  }
%s
}
"""
SKILLS_OF_THE_PAPER = """\
SkillDefinitionSet{
  Skill to_navigate {
    quality attributes [safety, performance, energy]
    input{DistanceToWall: float}
    result{
      success: "OK",
      error: "InternalError",
      inprogress: "IN_PROGRESS"
    }
  }
  Skill cover_area {
    quality attributes [safety, performance]
    input{AreaSize: float}
    result{
      success: "OK",
      error: "InternalError",
      inprogress: "IN_PROGRESS"
    }
  }
  Skill follow_wall {
    quality attributes [safety, performance]
    input{DistanceToGoal: float}
    result{
      success: "OK",
      error: "InternalError",
      inprogress: "IN_PROGRESS"
    }
  }
}
"""
REALIZATION_OF_THE_PAPER = """\
Realization f_slow_mode {
  Component amcl {
    Configuration active.DEFAULT{
      transform_tolerance: 0.2,
      alpha1: 0.2, alpha2: 0.2,
      alpha3: 0.2, alpha4: 0.2, alpha5: 0.2
    }
  },
  Component bt_navigator {
    Configuration active.DEFAULT{
      default_bt_xml_filename: "navigate_w_replanning_and_recovery.xml"
    }
  },
  Component controller_server {
    Configuration active.SLOW {
      Path.max_vel_x: 0.1, Path.max_speed_xy: 0.1,
      Path.max_vel_theta: 0.5, Path.transform_tolerance: 0.2
    }
  },
  Component pointcloud_to_laser {
    Configuration inactive
  },
  Component laser_resender observable {
    Configuration active.DEFAULT{node_name: "laser_resender"}
  }
  Quality[energy: 0.3, safety:0.7,performance:0.4];
  context: Default
};
"""
PAPER = SKILL_OF_THE_PAPER % REALIZATION_OF_THE_PAPER


def realization(name: str = "go", components: str = "Component motor active", rest: str = "", of: str = "") -> str:
    """Return a realization in the context Default."""
    return f"Realization {name}{f' of {of}' if of else ''} {{ {components} {rest} context: Default }};\n"


def skill(*realizations: str, name: str = "move", qualities: str = "speed") -> str:
    """Return a skill with realizations."""
    return f"Skill {name} {{ quality attributes [{qualities}]\n{''.join(realizations)}}}\n"


GOOD = skill(realization(rest="Quality [speed: 0.5];"))


def checked(text: str) -> CheckedSkills:
    """Return what a text holds, and what is wrong with it."""
    return checked_text(text, "f.skills")


def found(text: str, code: Code | None = None) -> list[Diagnostic]:
    """Return all that is wrong with a text, or what has a code."""
    return [each for each in checked(text).diagnostics if code is None or each.code is code]


def only(text: str, code: Code, severity: Severity = Severity.ERROR) -> Diagnostic:
    """Return the only diagnostic of a text that has a code; it has the severity."""
    (one,) = found(text, code)
    assert one.severity is severity, one
    return one


def errors(text: str) -> list[str]:
    """Return the errors of a text, as they are shown."""
    return [str(each) for each in found(text) if each.severity is Severity.ERROR]


def place_of(text: str, piece: str, number: int = 1) -> tuple[int, int]:
    """Return the line and column of the ``number``-th time that a piece is in a text."""
    start = -1
    for _ in range(number):
        start = text.index(piece, start + 1)
    return text.count("\n", 0, start) + 1, start - text.rfind("\n", 0, start)


def at(diagnostic: Diagnostic) -> tuple[int, int]:
    """Return where a diagnostic begins."""
    return diagnostic.place.line, diagnostic.place.column
