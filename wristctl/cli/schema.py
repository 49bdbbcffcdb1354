"""`wristctl schema`: the JSON schema of study files, for editors."""

import typer

from wristctl.cli.json_output import print_json
from wristctl.cli.options import Debug

app = typer.Typer(add_completion=False)


@app.command("schema")
def schema(debug: Debug = False) -> None:
    """Print the JSON schema of study files, by which editors complete keys and check values.

    Lay it beside a study file that begins with `# yaml-language-server: $schema=study.schema.json`; `wristctl init`
    does both.
    """
    from wristctl.study_files.json_schema import study_schema

    print_json(study_schema())
