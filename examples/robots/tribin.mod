MODULE tribin
  ! RAPID (ABB): takes parts with tribin robot-server. Not run on a controller yet.
  ! Set the address, tGripper, wobj0 (the base), signals and speeds before use.
  CONST string address := "192.168.1.10";
  CONST num port := 7000;
  PERS tooldata tGripper := [TRUE, [[0, 0, 180], [1, 0, 0, 0]], [1, [0, 0, 50], [1, 0, 0, 0], 0, 0, 0]];
  CONST confdata anyConf := [0, 0, 0, 0];
  CONST extjoint noExt := [9E9, 9E9, 9E9, 9E9, 9E9, 9E9];
  VAR socketdev link;

  ! One line. Strings hold 80 characters, and no line of tribin is longer.
  FUNC string readLine()
    VAR string line := "";
    VAR string char := "";
    WHILE TRUE DO
      SocketReceive link \Str := char \ReadNoOfBytes := 1 \Time := 30;
      IF char = "\0A" RETURN line;
      IF char <> "\0D" line := line + char;
    ENDWHILE
  ENDFUNC

  FUNC string ask(string line)
    SocketSend link \Str := line + "\0D\0A";
    RETURN readLine();
  ENDFUNC

  ! The field of a line, counted from 1.
  FUNC string field(string line, num index)
    VAR num from := 1;
    VAR num comma;
    FOR i FROM 2 TO index DO
      from := StrFind(line, from, ",") + 1;
    ENDFOR
    comma := StrFind(line, from, ",");
    RETURN StrPart(line, from, comma - from);
  ENDFUNC

  FUNC num value(string line, num index)
    VAR num result;
    IF NOT StrToVal(field(line, index), result) THEN
      TPWrite "tribin: no number in " + line;
      Stop;
    ENDIF
    RETURN result;
  ENDFUNC

  ! x, y, z in mm and q1..q4, behind P, pick, step, class.
  FUNC robtarget target(string line)
    RETURN [[value(line, 5), value(line, 6), value(line, 7)],
            NOrient([value(line, 8), value(line, 9), value(line, 10), value(line, 11)]), anyConf, noExt];
  ENDFUNC

  PROC main()
    VAR string answer;
    VAR string before;
    VAR string at;
    VAR string after;
    ConfJ \Off;
    ConfL \Off;
    SocketCreate link;
    SocketConnect link, address, port;
    IF field(ask("HELLO,1,abb"), 1) <> "100" THEN
      TPWrite "tribin does not greet";
      Stop;
    ENDIF
    WHILE TRUE DO
      answer := ask("SCAN");
      IF field(answer, 1) = "201" THEN
        answer := ask("GET,3");
        IF field(answer, 1) = "200" AND field(answer, 3) = "3" THEN
          before := readLine();
          at := readLine();
          after := readLine();
          MoveJ target(before), v200, fine, tGripper;
          MoveL target(at), v100, fine, tGripper;
          SetDO doGripper, 1;
          WaitTime 0.3;
          MoveL target(after), v200, fine, tGripper;
          IF DInput(diPartHeld) = 1 THEN
            answer := ask("DONE," + field(at, 2) + ",1");
            ! Put the part down here, then say DONE,id,4.
          ELSE
            SetDO doGripper, 0;
            answer := ask("DONE," + field(at, 2) + ",2");
          ENDIF
        ENDIF
      ELSE
        TPWrite "tribin: " + answer;
        Stop;
      ENDIF
    ENDWHILE
  ENDPROC
ENDMODULE
