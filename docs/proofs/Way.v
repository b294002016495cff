(* The service while no circle comes up: the way from the served place over full places to the first with room stays as it
   is, whoever else moves, as long as that place keeps a slot; and after the move of its last place it ends one place earlier.
   So the served head moves after as many moves of others as the way has places. *)
Require Import Model Chain Service.

Section Way.
Context `{R : roads}.
Hypothesis wide : forall p, 2 <= slots p.

(* z is n places after p, over full places *)
Inductive way (D : config) (p : nat) : nat -> nat -> Prop :=
| at_once : way D p 0 p
| onto n r x : way D p n r -> wants D r x -> full D x -> way D p (S n) x.

(* and the first with room is h *)
Definition leads_to (D : config) p n z h := way D p n z /\ wants D z h /\ ~ full D h.

Lemma one_way D p n : forall r x, way D p n r -> way D p n x -> r = x.
Proof.
  induction n as [|n IH]; intros r x A B; inversion A; inversion B; subst; auto.
  assert (r0 = r1) by (apply IH; auto). subst. eapply wants_one; eauto.
Qed.

Lemma goes_on D p n z : way D p n z -> forall k r, k < n -> way D p k r -> exists x, wants D r x /\ full D x.
Proof.
  induction 1 as [|n q z A IH W F]; intros k r L B; [lia|]. destruct (Nat.eq_dec k n) as [->|N]; [|apply (IH k); auto; lia].
  rewrite (one_way D p n r q); auto. eauto.
Qed.

Lemma mover_wants_room m (D E : config) : move m D E -> exists q, wants D m q /\ ~ full D q.
Proof.
  intros (s & line & Dm & Room & _). exists (place (next s)). split; auto. exists s. unfold head. rewrite Dm. auto.
Qed.

(* what does not move is left as it is *)
Lemma way_stays D E p n z m : possible D -> way D p n z -> move m D E ->
  forall k r, k <= n -> (k = n -> m <> z) -> way D p k r -> way E p k r.
Proof.
  intros P Z M. assert (Off : forall k r, k <= n -> (k = n -> m <> z) -> way D p k r -> r <> m).
  { intros k r L N B E0. subst r. destruct (mover_wants_room m D E M) as (q & Wq & Nq).
    destruct (Nat.eq_dec k n) as [->|Nk]; [apply (N eq_refl); apply (one_way D p n); auto|].
    destruct (goes_on D p n z Z k m) as (x & Wx & Fx); auto; [lia|]. rewrite (wants_one _ _ _ _ Wq Wx) in Nq. auto. }
  induction k as [|k IH]; intros r L N B; inversion B as [|k' y r' A W F]; subst; [constructor|].
  assert (Ny : y <> m) by (apply (Off k); auto; lia). assert (Nr : r <> m) by (apply (Off (S k)); auto).
  apply (onto E p k y); [apply IH; auto; lia|apply (wants_stays D E m); auto|].
  destruct M as (s & line & Dm & Room & Em & Eq & Rest). unfold full. rewrite Rest; auto. intro; subst. contradiction.
Qed.

Lemma others_leave_it D E p n z h m : possible D -> leads_to D p n z h -> move m D E -> m <> z -> ~ full E h ->
  leads_to E p n z h.
Proof.
  intros P (Z & W & _) M N F. split; [eapply way_stays; eauto|]. split; auto. apply (wants_stays D E m); auto.
Qed.

Lemma ends_earlier D E p n z h : possible D -> leads_to D p (S n) z h -> move z D E -> exists y, leads_to E p n y z.
Proof.
  intros P (Z & W & _) M. inversion Z as [|n' y z' A Wy F]; subst. exists y.
  assert (Ny : y <> z).
  { intro; subst y. destruct (goes_on D p (S n) z Z n z) as (x & Wx & Fx); auto.
    destruct (mover_wants_room z D E M) as (q & Wq & Nq). rewrite (wants_one _ _ _ _ Wq Wx) in Nq. auto. }
  split; [eapply (way_stays D E p (S n) z z); eauto; lia|]. split; [apply (wants_stays D E z); auto|].
  apply (left_has_room wide z D E P M). eauto.
Qed.

(* moves by others, and by last places of the way before the served head itself; how many were of the latter kind *)
Inductive served_so_far p : config -> nat -> config -> Prop :=
| not_yet D : served_so_far p D 0 D
| by_others D k E F n z h m : served_so_far p D k E -> leads_to E p n z h -> move m E F -> m <> z -> ~ full F h ->
    served_so_far p D k F
| by_mover D k E F n z h : served_so_far p D k E -> leads_to E p n z h -> move z E F -> z <> p -> served_so_far p D (S k) F.

Lemma same_end D p n z h n2 z2 h2 : leads_to D p n z h -> leads_to D p n2 z2 h2 -> n = n2 /\ z = z2 /\ h = h2.
Proof.
  intros (Z & W & F) (Z2 & W2 & F2). assert (E : n = n2).
  { destruct (lt_eq_lt_dec n n2) as [[L|E]|L]; auto; exfalso.
    - destruct (goes_on D p n2 z2 Z2 n z L Z) as (x & Wx & Fx). apply F. rewrite (wants_one _ _ _ _ W Wx). auto.
    - destruct (goes_on D p n z Z n2 z2 L Z2) as (x & Wx & Fx). apply F2. rewrite (wants_one _ _ _ _ W2 Wx). auto. }
  subst n2. assert (z = z2) by (eapply one_way; eauto). subst z2. split; auto. split; auto. eapply wants_one; eauto.
Qed.

Theorem way_gets_shorter D p n z h k E : possible D -> leads_to D p n z h -> served_so_far p D k E ->
  possible E /\ exists y g, leads_to E p (n - k) y g /\ k <= n.
Proof.
  intros P L So. induction So as [D|D k E F n2 z2 h2 m So IH L2 M N Fh|D k E F n2 z2 h2 So IH L2 M N].
  - split; auto. rewrite Nat.sub_0_r. exists z, h. split; auto. lia.
  - destruct (IH P L) as (PE & y & g & Ly & Le). split; [eapply move_possible; eauto|].
    destruct (same_end E p _ _ _ _ _ _ Ly L2) as (<- & <- & <-). exists y, g. split; auto. eapply others_leave_it; eauto.
  - destruct (IH P L) as (PE & y & g & Ly & Le). split; [eapply move_possible; eauto|].
    destruct (same_end E p _ _ _ _ _ _ Ly L2) as (E1 & <- & <-). destruct n2 as [|n2].
    + destruct L2 as (Z & _). inversion Z; subst. contradiction.
    + destruct (ends_earlier E F p n2 y g PE L2 M) as (x & Lx). exists x, y. replace (n - S k) with n2 by lia. split; auto. lia.
Qed.
End Way.
Print Assumptions others_leave_it.
Print Assumptions way_gets_shorter.
