(* Vehicles change their loops, and heads stand for good.

   A change of path leaves everybody where it stands and gives some vehicles other loops: `roads` has the spots of the old
   loops and of the new ones. A place whose head stands for good gives nobody away; B says which places these are. *)
Require Import Model Chain Crowd Service Way Ends Everyone.

Section Ways.
Context `{R : roads}.

Lemma way_app (D : config) a i b : way D a i b -> forall j c, way D b j c -> way D a (i + j) c.
Proof.
  intros A. induction j as [|j IH]; intros c C; inversion C; subst; [rewrite Nat.add_0_r; auto|].
  rewrite Nat.add_succ_r. eapply onto; eauto.
Qed.

(* a circle is one from each of its places *)
Lemma circle_from (D : config) p n k r : way D p (S n) p -> k <= S n -> way D p k r -> way D r (S n) r.
Proof.
  intros C L K. replace (S n) with (S n - k + k) by lia. apply (way_app D r (S n - k) p); auto.
  apply (way_from D p k); auto. replace (k + (S n - k)) with (S n) by lia. auto.
Qed.

(* everybody stands where it stood, in the same order, on another loop perhaps *)
Definition relaid (D E : config) := possible E /\ forall p, length (E p) = length (D p).

(* whose heads want what they wanted, or anything, where the place is one of K *)
Definition heads_change_in (K : nat -> Prop) (D E : config) := forall p q, ~ K p -> (wants E p q <-> wants D p q).

(* if there was no circle, one that a change of loops makes has a place whose head wants another place than before *)
Theorem new_circle_passes_a_change K D E : relaid D E -> heads_change_in K D E -> ~ circle D -> circle E ->
  exists p n, K p /\ way E p (S n) p.
Proof.
  intros [_ Len] Same N (p & n & C). apply NNPP. intro No. apply N. exists p, n.
  assert (H : forall k r, k <= S n -> way E p k r -> way D p k r).
  { induction k as [|k IH]; intros r L W; inversion W as [|k' y r' A Wy F]; subst; [constructor|].
    apply (onto D p k y); [apply IH; auto; lia| |unfold full in *; congruence]. apply Same; auto. intro Ky.
    apply No. exists y, n. split; auto. apply (circle_from E p n k); auto. lia. }
  apply H; auto.
Qed.
End Ways.

Section Change.
Context `{R : roads}.
Hypothesis wide : forall p, 2 <= slots p.
Variable places : nat.
Hypothesis all_places : forall s, place s < places.
Variable spots : list spot.
Hypothesis all_spots : forall s, In s spots.
Hypothesis spot_eq : forall s t : spot, {s = t} + {s <> t}.
Hypothesis closed : forall s, exists k, far (S k) s = s.

Let live_for_everyone := live_for_everyone wide places all_places spots all_spots spot_eq closed.

(* Change of path: whoever was live stays live iff no circle goes through a place whose head wants another place now, and
   (S) holds for the new loops. *)
Theorem change_of_path K D E : possible D -> live D -> relaid D E -> heads_change_in K D E ->
  (live E <-> (forall p n, K p -> ~ way E p (S n) p) /\ uncrowded E).
Proof.
  intros P Lv Re Same. assert (PE : possible E) by apply Re. rewrite (live_for_everyone E PE).
  apply (live_for_everyone D P) in Lv. split.
  - intros [N U]. split; auto. intros p n _ W. apply N. exists p, n. auto.
  - intros [N U]. split; auto. intro C. destruct (new_circle_passes_a_change K D E Re Same) as (p & n & Kp & W); [tauto|auto|].
    apply (N p n Kp W).
Qed.

(* how many vehicles are on loops that f holds of *)
Definition on_loops (f : spot -> bool) (D : config) := residents (seq 0 places) f D.

(* on each loop as many vehicles, wherever they stand *)
Definition same_loops (D E : config) := forall f, (forall s, f (next s) = f s) -> on_loops f D = on_loops f E.

Lemma moves_keep_loops p D E : possible D -> move p D E -> same_loops D E.
Proof.
  intros P M f St. symmetry. apply (residents_stay _ (seq_NoDup places 0) f St) with (p := p); auto.
  intros s _. apply in_seq. pose proof (all_places s). lia.
Qed.

Lemma sum_within m : NoDup m -> forall l, NoDup l -> forall g, (forall p, g p <> 0 -> In p m) -> sum g l <= sum g m.
Proof.
  intros Nm l. induction l as [|a l IH]; intros Nl g I; [unfold sum; simpl; lia|]. inversion Nl; subst.
  change (sum g (a :: l)) with (g a + sum g l). destruct (Nat.eq_dec (g a) 0) as [Z|Z]; [rewrite Z; apply IH; auto|].
  rewrite (sum_of g m a Nm (I a Z)). apply Nat.add_le_mono_l.
  rewrite (sum_ext g (fun p => if Nat.eq_dec p a then 0 else g p) l).
  - apply IH; auto. intros p. destruct (Nat.eq_dec p a); auto.
  - intros p Ip. destruct (Nat.eq_dec p a); auto. subst. contradiction.
Qed.

(* residents of Q stand in Q *)
Lemma residents_are_in Q f D : possible D -> NoDup Q -> (forall s, f s = true -> In (place s) Q) ->
  residents Q f D = on_loops f D.
Proof.
  intros P ND In_. unfold on_loops, residents. assert (Nz : forall p, count f true (D p) <> 0 -> exists s, In s (D p) /\ f s = true).
  { intros p N. unfold count in N. destruct (filter _ (D p)) as [|s l] eqn:F; [simpl in N; contradiction|]. exists s.
    assert (I : In s (filter (fun t => Bool.eqb (f t) true) (D p))) by (rewrite F; left; auto).
    apply filter_In in I. destruct I as [I T]. split; auto. destruct (f s); auto. }
  assert (Some_ : forall p, count f true (D p) <> 0 -> In p Q /\ In p (seq 0 places)).
  { intros p N. destruct (Nz p N) as (s & I & T). destruct (P p) as [_ H]. rewrite <- (H s I). split; auto.
    apply in_seq. pose proof (all_places s). lia. }
  apply Nat.le_antisymm; apply sum_within; auto using seq_NoDup; intros p N; apply Some_; auto.
Qed.

Lemma crosses_next Q s : crosses Q (next s) <-> crosses Q s.
Proof.
  assert (Back : forall A : spot -> Prop, (exists k, A (far k s)) -> exists k, A (far k (next s))).
  { intros A [[|k] H]; [|exists k; auto]. destruct (closed s) as [j J]. exists j. simpl in J. rewrite J. auto. }
  split.
  - intros [[k A] [j B]]. split; [exists (S k)|exists (S j)]; auto.
  - intros [A B]. split; [apply (Back (fun t => In (place t) Q)); auto|apply (Back (fun t => ~ In (place t) Q)); auto].
Qed.

Lemma someone_on_loops f D : possible D -> (0 < on_loops f D <-> exists p s, In s (D p) /\ f s = true).
Proof.
  intro P. unfold on_loops, residents. split.
  - intro L. apply NNPP. intro No. assert (Z : sum (fun p => count f true (D p)) (seq 0 places) <= sum (fun _ => 0) (seq 0 places)).
    { apply sum_le. intros p _. unfold count. destruct (filter _ (D p)) as [|s l] eqn:F; auto. exfalso. apply No.
      assert (I : In s (filter (fun t => Bool.eqb (f t) true) (D p))) by (rewrite F; left; auto).
      apply filter_In in I. destruct I as [I T]. exists p, s. split; auto. destruct (f s); auto. }
    assert (Zero : forall l, sum (fun _ => 0) l = 0) by (intro l; unfold sum; induction l; simpl; auto).
    rewrite Zero in Z. lia.
  - intros (p & s & I & T). assert (Ip : In p (seq 0 places)).
    { apply in_seq. destruct (P p) as [_ H]. pose proof (all_places s) as A. rewrite (H s I) in A. lia. }
    rewrite (sum_of _ _ p (seq_NoDup places 0) Ip). assert (1 <= count f true (D p)); [|lia].
    apply in_split in I. destruct I as (a & b & ->). replace (a ++ s :: b) with (a ++ [s] ++ b) by auto.
    rewrite !count_app, count_one, T. simpl. lia.
Qed.

(* (S) depends on how many vehicles are on which loop, and on nothing else *)
Theorem crowds_are_of_loops D E : possible D -> possible E -> same_loops D E -> uncrowded D -> uncrowded E.
Proof.
  intros P PE Same U Q f ND St In_ (x & s & I & C). rewrite (residents_are_in Q f E), <- (Same f St), <- (residents_are_in Q f D); auto.
  apply U; auto. destruct (table spot_eq false (fun s b => b = true <-> crosses Q s) spots) as [g Hg'].
  { intros t _. destruct (classic (crosses Q t)); [exists true; tauto|exists false; split; [discriminate|contradiction]]. }
  assert (Hg : forall t, g t = true <-> crosses Q t) by auto. clear Hg'.
  assert (Sg : forall t, g (next t) = g t).
  { intro t. destruct (g t) eqn:A, (g (next t)) eqn:B; auto; exfalso.
    - assert (g (next t) = true); [|congruence]. apply Hg, crosses_next, Hg. auto.
    - assert (g t = true); [|congruence]. apply Hg, crosses_next, Hg. auto. }
  assert (Some_ : 0 < on_loops g D).
  { rewrite (Same g Sg). apply someone_on_loops; auto. exists x, s. split; auto. apply Hg. auto. }
  apply someone_on_loops in Some_; auto. destruct Some_ as (p & t & It & T). exists p, t. split; auto. apply Hg. auto.
Qed.

(* so whether everyone is live depends on where they stand through circles alone, and on loops through (S) alone *)
Theorem live_depends_on D E : possible D -> possible E -> same_loops D E -> (circle D <-> circle E) -> (live D <-> live E).
Proof.
  intros P PE Same C. rewrite (live_for_everyone D P), (live_for_everyone E PE), C.
  assert (Back : same_loops E D) by (intros f St; symmetry; apply Same; auto).
  split; intros [N U]; split; auto; [apply (crowds_are_of_loops D E)|apply (crowds_are_of_loops E D)]; auto.
Qed.

(* nothing but circles has to be looked at, where all could stand with a slot free in every place *)
Theorem roomy_change K D E F : possible D -> live D -> relaid D E -> heads_change_in K D E ->
  possible F -> (forall p, ~ full F p) -> same_loops F E -> (live E <-> forall p n, K p -> ~ way E p (S n) p).
Proof.
  intros P Lv Re Same PF Ro SL. rewrite (change_of_path K D E P Lv Re Same). split; [tauto|]. intro N. split; auto.
  apply (crowds_are_of_loops F E); auto; [apply Re|]. apply roomy_is_uncrowded; auto.
Qed.

(* Breakdown. *)
Variable B : nat -> bool.

(* who does not stand in a place of B can go on for ever, without a move from there, and nobody else is lost in there *)
Definition keeps_but (L : config -> Prop) := forall D p a s b, L D -> B p = false -> D p = a ++ s :: b ->
  exists l E, run D l E /\ (forall q, In q l -> B q = false) /\ L E /\ (forall q, B q = true -> E q = D q) /\
    length a < times p l.
Definition live_but (D : config) := exists L, keeps_but L /\ (forall E, L E -> possible E) /\ L D.

Definition without (D : config) : config := fun p => if B p then [] else D p.
(* the loop of nobody else leads there *)
Definition avoids (D : config) := forall p s k, B p = false -> In s (D p) -> B (place (far k s)) = false.

Lemma without_possible D : possible D -> possible (without D).
Proof. intros P p. unfold without. destruct (B p); [split; [simpl; lia|intros s []]|apply P]. Qed.

Lemma avoids_move p D E : possible D -> avoids D -> B p = false -> move p D E ->
  avoids E /\ forall q, B q = true -> E q = D q.
Proof.
  intros P A Bp (s & line & Dp & Room & Ep & Et & Rest). assert (Is : In s (D p)) by (rewrite Dp; left; auto).
  assert (Bt : B (place (next s)) = false) by (apply (A p s 1); auto). split.
  - intros r t k Br I. destruct (Nat.eq_dec r p) as [->|Np]; [apply (A p); auto; rewrite Dp; right; rewrite <- Ep; auto|].
    destruct (Nat.eq_dec r (place (next s))) as [->|Nt]; [|rewrite Rest in I by auto; apply (A r); auto].
    rewrite Et in I. apply in_app_or in I. destruct I as [I|[<-|[]]]; [apply (A (place (next s))); auto|apply (A p s (S k)); auto].
  - intros q Bq. apply Rest; intro; subst; congruence.
Qed.

(* moves of the others are moves without those in B, and the other way round *)
Lemma lower p D E F : possible D -> avoids D -> B p = false -> move p D E -> (forall r, F r = without D r) -> move p F (without E).
Proof.
  intros P A Bp M Same. destruct M as (s & line & Dp & Room & Ep & Et & Rest).
  assert (Bt : B (place (next s)) = false) by (apply (A p s 1); auto; rewrite Dp; left; auto).
  exists s, line. unfold full in *. rewrite !Same. unfold without. rewrite Bp, Bt. repeat (split; auto).
  intros r N1 N2. rewrite Same. unfold without. destruct (B r); auto.
Qed.

Lemma lift p D F G : possible D -> avoids D -> (forall r, F r = without D r) -> move p F G ->
  B p = false /\ exists E, move p D E /\ forall r, G r = without E r.
Proof.
  intros P A Same (s & line & Fp & Room & Gp & Gt & Rest). rewrite Same in Fp. unfold without in Fp. destruct (B p) eqn:Bp; [discriminate|].
  assert (Bt : B (place (next s)) = false) by (apply (A p s 1); auto; rewrite Fp; left; auto). split; auto.
  assert (Ft : F (place (next s)) = D (place (next s))) by (rewrite Same; unfold without; rewrite Bt; auto).
  exists (fun r => if B r then D r else G r). split.
  - exists s, line. unfold full in *. rewrite Ft in *. rewrite Bp, Bt. repeat (split; auto).
    intros r N1 N2. destruct (B r) eqn:Br; auto. rewrite Rest, Same; auto. unfold without. rewrite Br. auto.
  - intro r. unfold without. destruct (B r) eqn:Br; auto. rewrite Rest, Same; [|intro; subst; congruence|intro; subst; congruence].
    unfold without. rewrite Br. auto.
Qed.

Lemma lower_run D l E : run D l E -> possible D -> avoids D -> (forall q, In q l -> B q = false) ->
  forall F, (forall r, F r = without D r) -> exists G, run F l G /\ forall r, G r = without E r.
Proof.
  induction 1 as [D|p D E l G M Rn IH]; intros P A Out F Same; [exists F; split; auto; constructor|].
  assert (Bp : B p = false) by (apply Out; left; auto). destruct (avoids_move p D E P A Bp M) as [AE _].
  destruct (IH (move_possible p D E P M) AE) with (F := without E) as (H & Rh & Sh); auto; [intros; apply Out; right; auto|].
  exists H. split; auto. eapply more; eauto. apply (lower p D E F); auto.
Qed.

Lemma lift_run F l G : run F l G -> forall D, possible D -> avoids D -> (forall r, F r = without D r) ->
  exists E, run D l E /\ (forall q, In q l -> B q = false) /\ possible E /\ avoids E /\ (forall r, G r = without E r) /\
    forall q, B q = true -> E q = D q.
Proof.
  induction 1 as [F|p F G l H M Rn IH]; intros D P A Same.
  - exists D. split; [constructor|]. split; [intros q []|auto].
  - destruct (lift p D F G P A Same M) as (Bp & E & ME & SE). assert (PE := move_possible p D E P ME).
    destruct (avoids_move p D E P A Bp ME) as [AE Keep].
    destruct (IH E PE AE SE) as (X & Rx & Out & PX & AX & SX & KX). exists X. split; [eapply more; eauto|].
    split; [intros q [<-|I]; auto|]. split; auto. split; auto. split; auto. intros q Bq. rewrite KX; auto.
Qed.

(* who enters a place from which nobody moves makes its line longer *)
Lemma grows D l E q : run D l E -> possible D -> ~ In q l -> length (D q) <= length (E q).
Proof.
  induction 1 as [D|p D E l F M Rn IH]; intros P N; auto. transitivity (length (E q)).
  - destruct (line_after p D E q P M) as [H|[t H]]; [intro; subst; apply N; left; auto| |]; rewrite H, ?app_length; lia.
  - apply IH; [eapply move_possible; eauto|]. intro. apply N. right. auto.
Qed.

Lemma entered D l E s : run D l E -> possible D -> passes D l E s -> ~ In (place (next s)) l ->
  length (D (place (next s))) < length (E (place (next s))).
Proof.
  intros Rn P (l1 & F & G & l2 & -> & R1 & Hd & M & R2) N. set (q := place (next s)) in *.
  assert (PF := run_possible _ _ _ R1 P). assert (PG := move_possible _ _ _ PF M).
  assert (A : length (D q) <= length (F q)) by (apply (grows D l1 F); auto; intro; apply N; apply in_or_app; auto).
  assert (C : length (G q) <= length (E q)) by (apply (grows G l2 E); auto; intro; apply N; apply in_or_app; right; right; auto).
  unfold head in Hd. destruct (F (place s)) as [|t line] eqn:Fs; [discriminate|]. injection Hd as ->.
  destruct (head_goes s line F G PF M Fs) as [_ Gt]. unfold q in *. rewrite Gt, app_length in C. simpl in C. lia.
Qed.

Lemma must_avoid L : keeps_but L -> (forall E, L E -> possible E) -> forall D, L D -> avoids D.
Proof.
  intros K Ps D LD p s k. revert D p s LD. induction k as [k IH] using lt_wf_ind. intros D p s LD Bp I.
  assert (P := Ps D LD). destruct (in_split _ _ I) as (a & b & Dp).
  destruct (K D p a s b LD Bp Dp) as (l & E & Rn & Out & LE & Keep & T).
  destruct (along D l E Rn P p a s b Dp) as (j & Ij & Through & More). specialize (More T).
  assert (On : forall i, i < j -> B (place (far (S i) s)) = false).
  { intros i L0. destruct (B (place (far (S i) s))) eqn:Bi; auto. exfalso.
    assert (Next : next (far i s) = far (S i) s) by (replace (S i) with (i + 1) by lia; rewrite <- far_far; auto).
    assert (G := entered D l E (far i s) Rn P (Through i L0)). rewrite Next in G. rewrite (Keep _ Bi) in G.
    assert (X : ~ In (place (far (S i) s)) l) by (intro X; apply Out in X; congruence). specialize (G X). lia. }
  destruct k as [|k]; [simpl; rewrite (stands_here D p a s b P Dp); auto|].
  destruct (le_lt_dec (S k) j) as [Le|Lt]; [apply On; lia|].
  replace (far (S k) s) with (far (S k - j) (far j s)) by (rewrite far_far; f_equal; lia).
  apply (IH (S k - j)) with (D := E) (p := place (far j s)); auto; [lia|]. destruct j as [|j]; [lia|]. apply On. lia.
Qed.

Theorem breakdown D : possible D -> (live_but D <-> avoids D /\ ~ circle (without D) /\ uncrowded (without D)).
Proof.
  intro P. rewrite <- (live_for_everyone (without D) (without_possible D P)). split.
  - intros (L & K & Ps & LD). assert (A := must_avoid L K Ps). split; [apply A; auto|].
    exists (fun F => exists E, L E /\ forall r, F r = without E r). split; [|exists D; auto].
    intros F p a s b (E & LE & Same) Fp. rewrite Same in Fp. unfold without in Fp.
    destruct (B p) eqn:Bp; [destruct a; discriminate|].
    destruct (K E p a s b LE Bp Fp) as (l & G & Rn & Out & LG & Keep & T).
    destruct (lower_run E l G Rn (Ps E LE) (A E LE) Out F Same) as (H & Rh & Sh). exists l, H. split; auto. split; auto. exists G. auto.
  - intros (A & L & K & LD). exists (fun E => possible E /\ avoids E /\ exists F, L F /\ forall r, F r = without E r).
    split; [|split; [tauto|split; auto; split; auto; exists (without D); auto]].
    intros E p a s b (PE & AE & F & LF & Same) Bp Ep.
    assert (Fp : F p = a ++ s :: b) by (rewrite Same; unfold without; rewrite Bp; auto).
    destruct (K F p a s b LF Fp) as (l & G & Rn & LG & T).
    destruct (lift_run F l G Rn E PE AE Same) as (X & Rx & Out & PX & AX & SX & KX).
    exists l, X. split; auto. split; auto. split; [split; auto; split; auto; exists G; auto|auto].
Qed.

(* a circle of the others is a circle with a place outside B *)
Theorem circle_of_others D : possible D -> avoids D -> (circle (without D) <-> exists p n, B p = false /\ way D p (S n) p).
Proof.
  intros P A. assert (Full : forall r, full (without D) r -> B r = false /\ full D r).
  { intros r F. unfold full, without in *. destruct (B r) eqn:E; [|auto]. simpl in F. pose proof (wide r). lia. }
  assert (Wants : forall r x, wants (without D) r x -> B r = false /\ wants D r x).
  { intros r x (s & H & W). unfold head, without in H. destruct (B r); [discriminate|]. split; auto. exists s. auto. }
  split.
  - intros (p & n & W). exists p, n. assert (H : forall k r, way (without D) p k r -> way D p k r).
    { induction k as [|k IH]; intros r X; inversion X; subst; [constructor|]. eapply onto; [apply IH; eauto|apply Wants; auto|apply Full; auto]. }
    split; auto. inversion W; subst. apply Full. auto.
  - intros (p & n & Bp & W). exists p, n. assert (H : forall k r, way D p k r -> way (without D) p k r /\ B r = false).
    { induction k as [|k IH]; intros r X; inversion X as [|k' y r' Wy Wr F]; subst; [split; auto; constructor|].
      destruct (IH y Wy) as [Z By]. assert (Br : B r = false).
      { destruct Wr as (s & Hs & <-). apply (A y s 1 By). unfold head in Hs. destruct (D y); [discriminate|]. injection Hs as ->. left. auto. }
      split; auto. apply (onto (without D) p k y); auto.
      - destruct Wr as (s & Hs & Ws). exists s. split; auto. unfold head, without. rewrite By. auto.
      - unfold full, without. rewrite Br. auto. }
    apply H. auto.
Qed.

(* when all heads go on again everyone is live, those behind them too, iff (S) holds with them, and they are in no circle themselves *)
Theorem goes_again D : possible D -> live_but D -> (forall p n, B p = true -> ~ way D p (S n) p) -> (live D <-> uncrowded D).
Proof.
  intros P Lb NB. rewrite (live_for_everyone D P). apply (breakdown D P) in Lb. destruct Lb as (A & N & _).
  split; [tauto|]. intro U. split; auto. intros (p & n & W). destruct (B p) eqn:Bp; [apply (NB p n Bp W)|].
  apply N. apply (circle_of_others D P A). eauto.
Qed.
End Change.
Print Assumptions new_circle_passes_a_change.
Print Assumptions change_of_path.
Print Assumptions crowds_are_of_loops.
Print Assumptions live_depends_on.
Print Assumptions roomy_change.
Print Assumptions breakdown.
Print Assumptions circle_of_others.
Print Assumptions goes_again.
